"""Read the lists of words and patterns that sentences are made of: `phrases/lists/*.toml`."""

import tomllib
from pathlib import Path
from typing import Any, Final

PHRASES: Final = Path(__file__).parents[1] / "phrases"


def read_file(name: str) -> dict[str, Any]:
    """Return a file of lists as it is."""
    return tomllib.loads((PHRASES / "lists" / f"{name}.toml").read_text(encoding="utf-8"))


def read_lists(name: str) -> dict[str, tuple[str, ...]]:
    """Return the lists of a file by their names."""
    return {key: tuple(words) for key, words in read_file(name).items()}
