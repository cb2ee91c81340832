"""Fetch published Whispers from the Hugging Face hub, as `vla_deploy.inference.hub` does."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.hub import HubCommit, HubPlace
from vla_deploy.speech.model_tools.adding import PARTS

ENGLISH: Final = ("en",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """Name where a model is published, and what it understands."""

    repository: str
    summary: str
    licence: str = "MIT"
    languages: tuple[str, ...] = ENGLISH


def _whisper(size: str, memory: str) -> Published:
    return Published(
        repository=f"Systran/faster-whisper-{size}",
        summary=f"OpenAI's Whisper {size}, converted by SYSTRAN; {memory} of memory in int8",
    )


PUBLISHED: Final[Mapping[str, Published]] = MappingProxyType(
    {
        "whisper-tiny.en": _whisper("tiny.en", "220 MB"),
        "whisper-base.en": _whisper("base.en", "300 MB"),
        "whisper-small.en": _whisper("small.en", "540 MB"),
        "whisper-medium.en": _whisper("medium.en", "1.1 GB"),
        "whisper-tiny": _whisper("tiny", "220 MB"),
        "whisper-base": _whisper("base", "300 MB"),
        "whisper-small": _whisper("small", "540 MB"),
    }
)


def fetch(
    name: str, folder: Path, tell: Callable[[str], None], endpoint: str | None = None
) -> Published:
    """Fetch a model's files into an empty folder, and check them.

    Raises:
        ModelUnknown: no model of that name is known.
        FetchFailed: the hub cannot be reached, or does not have it, or the disk is full.
        ModelFileSpoiled: a file is not what the hub says it is.
        ToolMissing: the hub's client is not installed.
    """
    published = PUBLISHED.get(name)
    if published is None:
        raise ModelUnknown(f"no model {name!r} to fetch: expected one of {', '.join(PUBLISHED)}")
    commit = HubCommit(
        HubPlace(
            repository=published.repository,
            by_hand="vla-deploy models add NAME --whisper FOLDER",
            endpoint=endpoint,
        )
    )
    commit.fetch([path for path in commit.paths if path in PARTS], folder, tell)
    return published
