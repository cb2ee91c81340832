"""Describe a requested recording: which channels, for how long; check requests."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Final

from vla_deploy.ipc.payloads.recording import RecordingStart
from vla_deploy.telemetry.errors import RecordingRefused

EVERYTHING: Final = ("*",)
START: Final = "start"
STOP: Final = "stop"
LONGEST_S: Final = 7 * 24 * 3600.0
_LABEL: Final = re.compile(r"[a-z0-9_]{1,40}")
_MOST_PATTERNS: Final = 50
_PATTERN_LETTERS: Final = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSelection:
    """Choose what one of `topics` matches and none of `without`; `*`, `?`, `[...]` are wildcards.

    The name of a topic stands for all its channels: `rgbd` for `rgbd/colour` and `rgbd/depth`.
    """

    topics: tuple[str, ...] = EVERYTHING
    without: tuple[str, ...] = ()
    _known: dict[str, bool] = field(default_factory=dict, repr=False, compare=False)

    def takes(self, channel: str) -> bool:
        """Return whether a channel is chosen."""
        known = self._known.get(channel)
        if known is None:
            known = _matches(channel, self.topics) and not _matches(channel, self.without)
            self._known[channel] = known
        return known

    def takes_any_of(self, topic: str) -> bool:
        """Return whether a topic or one of an image's two channels is chosen."""
        return self.takes(topic) or any(
            self.takes(f"{topic}/{part}") for part in ("colour", "depth")
        )

    def among(self, channels: Iterable[str]) -> tuple[str, ...]:
        """Return the chosen channels.

        Raises:
            RecordingRefused: a pattern matches none of them, or nothing is left.
        """
        names = tuple(channels)
        for pattern in (*self.topics, *self.without):
            if not any(_matches(name, (pattern,)) for name in names):
                raise RecordingRefused(
                    f"no topic matches {pattern!r}; there are, for instance, "
                    f"{', '.join(names[:3])}; see: vla-deploy record topics"
                )
        chosen = tuple(name for name in names if self.takes(name))
        if not chosen:
            raise RecordingRefused(
                f"topics {', '.join(self.topics)} without {', '.join(self.without)} leaves nothing"
            )
        return chosen


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingRequest:
    """Describe a recording to be made; without `duration_s` it goes on until stopped."""

    topics: tuple[str, ...] = EVERYTHING
    without: tuple[str, ...] = ()
    duration_s: float | None = None
    label: str = "recording"
    source: str = ""

    @property
    def selection(self) -> ChannelSelection:
        """Return the choice of channels."""
        return ChannelSelection(topics=self.topics, without=self.without)

    def document(self) -> RecordingStart:
        """Return the document for the topic `recording_request`."""
        return {
            "act": START,
            "topics": self.topics,
            "without": self.without,
            "duration_s": self.duration_s,
            "label": self.label,
            "source": self.source,
        }


def parse_request(document: Mapping[str, Any]) -> RecordingRequest:
    """Return the recording that a document on `recording_request` asks for.

    Raises:
        RecordingRefused: values are of another type, or out of range; the text has all of them.
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
    return RecordingRequest(**values)


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


def checked(request: RecordingRequest, channels: Iterable[str]) -> RecordingRequest:
    """Return a request after checking its values and that each pattern matches a channel.

    Raises:
        RecordingRefused: a value is out of range, or a pattern matches no channel.
    """
    parse_request(request.document())
    request.selection.among(channels)
    return request


def _matches(channel: str, patterns: Iterable[str]) -> bool:
    topic = channel.partition("/")[0]
    return any(fnmatchcase(channel, pattern) or fnmatchcase(topic, pattern) for pattern in patterns)
