"""Fetch published Whispers from the Hugging Face hub, as `vla_deploy.inference.hub` does."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.hub import HubCommit, HubPlace
from vla_deploy.speech.model_tools.adding import PARTS

LICENCE: Final = "MIT"
PUBLISHED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "whisper-tiny.en": "220 MB",
        "whisper-base.en": "300 MB",
        "whisper-small.en": "540 MB",
        "whisper-medium.en": "1.1 GB",
        "whisper-tiny": "220 MB",
        "whisper-base": "300 MB",
        "whisper-small": "540 MB",
    }
)
"""OpenAI's Whispers as SYSTRAN converted them, and the memory that each takes in int8."""


def summary_of(name: str) -> str:
    """Return what a published model is, for people."""
    return f"OpenAI's {name}, converted by SYSTRAN; {PUBLISHED[name]} of memory in int8"


def fetch(
    name: str, folder: Path, tell: Callable[[str], None], endpoint: str | None = None
) -> None:
    """Fetch a model's files into an empty folder, and check them; `tell` gets a line for each.

    Raises:
        ModelUnknown: no model of that name is known.
        FetchFailed: the hub cannot be reached, or does not have it, or the disk is full.
        ModelFileSpoiled: a file is not what the hub says it is.
        ToolMissing: the hub's client is not installed.
    """
    if name not in PUBLISHED:
        raise ModelUnknown(f"no model {name!r} to fetch: expected one of {', '.join(PUBLISHED)}")
    commit = HubCommit(
        HubPlace(
            repository=f"Systran/faster-{name}",
            by_hand="vla-deploy models add NAME --whisper FOLDER",
            endpoint=endpoint,
        )
    )
    commit.fetch([path for path in commit.paths if path in PARTS], folder, tell)
