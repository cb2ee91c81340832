"""Check what is asked of the recorder: to begin a recording, or to end it."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.recording.selection import EVERYTHING, Selection

START: Final = "start"
STOP: Final = "stop"
LONGEST_S: Final = 7 * 24 * 3600.0
_LABEL: Final = re.compile(r"[a-z0-9_]{1,40}")
_MOST_PATTERNS: Final = 50
_PATTERN_LETTERS: Final = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingWish:
    """Say what is to be recorded; without `duration_s` it goes on until it is ended."""

    topics: tuple[str, ...] = EVERYTHING
    without: tuple[str, ...] = ()
    duration_s: float | None = None
    label: str = "recording"
    source: str = ""

    @property
    def selection(self) -> Selection:
        """Return the choice of channels."""
        return Selection(topics=self.topics, without=self.without)

    def document(self) -> dict[str, Any]:
        """Return the request as `recording_request` carries it."""
        return {"act": START, **asdict(self)}


def wish_of(document: Mapping[str, Any]) -> RecordingWish:
    """Return what a request wants recorded.

    Raises:
        RecordingRefused: a value is of another type, or out of range; all of them are told.
    """
    known = {name: document[name] for name in _CHECKS if document.get(name) is not None}
    faults = [
        f"{name}: expected {expected}, got {known[name]!r:.80}"
        for name, (holds, expected) in _CHECKS.items()
        if name in known and not holds(known[name])
    ]
    if faults:
        raise RecordingRefused("; ".join(faults))
    values: dict[str, Any] = {
        name: tuple(value) if name in ("topics", "without") else value
        for name, value in known.items()
    }
    return RecordingWish(**values)


def _are_patterns(value: object) -> bool:
    return (
        isinstance(value, list | tuple)
        and len(value) <= _MOST_PATTERNS
        and all(isinstance(one, str) and 0 < len(one) <= _PATTERN_LETTERS for one in value)
    )


def _is_duration(value: object) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(value) and 0 < value <= LONGEST_S  # type: ignore[arg-type,operator]


_PATTERNS: Final = f"at most {_MOST_PATTERNS} patterns of at most {_PATTERN_LETTERS} letters"
_CHECKS: Final[Mapping[str, tuple[Any, str]]] = {
    "topics": (lambda value: _are_patterns(value) and bool(value), f"a list, {_PATTERNS}"),
    "without": (_are_patterns, f"a list, {_PATTERNS}"),
    "duration_s": (_is_duration, f"seconds, above 0 and at most {LONGEST_S:.0f}"),
    "label": (
        lambda value: isinstance(value, str) and bool(_LABEL.fullmatch(value)),
        "1 to 40 of a-z, 0-9 and _",
    ),
    "source": (lambda value: isinstance(value, str) and len(value) <= 50, "at most 50 letters"),
}


def checked(wish: RecordingWish, channels: Iterable[str]) -> RecordingWish:
    """Return a wish whose patterns all match something.

    Raises:
        RecordingRefused: one of its values cannot be, or a pattern matches no channel.
    """
    wish_of(wish.document())
    wish.selection.among(channels)
    return wish
