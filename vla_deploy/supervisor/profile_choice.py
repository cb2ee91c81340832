"""Remember which profile a person has chosen, for the next start."""

import json
import os
from pathlib import Path
from typing import Final

from platforms.board import identify
from vla_deploy.state_dir import library_dir_of
from vla_deploy.supervisor.runtime import default_base

_NAME: Final = "profile.json"
_FALLBACK: Final = "desktop"


class ProfileChoice:
    """Keep the chosen profile in a small file; the old choice stays until the new one is whole."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> str | None:
        """Return the chosen profile; None when none is, or what is there cannot be read."""
        try:
            chosen = json.loads(self.path.read_text())["profile"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return chosen if isinstance(chosen, str) else None

    def save(self, profile: str) -> None:
        """Choose a profile.

        Raises:
            OSError: the file cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_name(f".{self.path.name}-{os.getpid()}")
        fresh.write_text(json.dumps({"profile": profile}) + "\n")
        with fresh.open("rb") as written:
            os.fsync(written.fileno())
        fresh.replace(self.path)


def choice_of(runtime_base: Path | None) -> ProfileChoice:
    """Return where the choice for the runs of a runtime directory is kept, whoever asks."""
    return ProfileChoice(library_dir_of(runtime_base or default_base()) / _NAME)


def start_profile(runtime_base: Path | None, root: Path = Path("/")) -> tuple[str, str]:
    """Return the profile to start with when none is given, and why."""
    chosen = choice_of(runtime_base).load()
    if chosen is not None:
        return chosen, "chosen by: vla-deploy profile use"
    return detect(root)


def detect(root: Path = Path("/")) -> tuple[str, str]:
    """Return the profile made for this computer, and why."""
    board = identify(root)
    reasons = "; ".join(board.reasons)
    if board.profile_name is None:
        return _FALLBACK, f"{board.name} is not known: {reasons}"
    return board.profile_name, f"{board.name}" + (f": {reasons}" if reasons else "")
