"""Hold what all processes told at one moment, so that judging it needs nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from vla_deploy.ipc import BY_NAME

Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Word:
    """Hold the newest value of a cell: how old, and its document; of packed fields, "pose" alone.

    That one is `{"state", "doubt", "match_ratio"}`, in words as `status` tells them.
    """

    age_s: float
    document: Document | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """Hold the newest word on each topic; what nobody has ever told is missing.

    `late_ratio` is the share of control's ticks of the last seconds that came late, None before
    enough of them went by.
    """

    words: Mapping[str, Word] = field(default_factory=dict)
    late_ratio: float | None = None

    def age_s(self, topic: str) -> float | None:
        """Return how old the newest word on a topic is."""
        word = self.words.get(topic)
        return None if word is None else word.age_s

    def document(self, topic: str) -> Document | None:
        """Return the newest document of a topic, None where it is too old to be believed."""
        word = self.words.get(topic)
        if word is None or word.age_s > BY_NAME[topic].deadline_s:
            return None
        return word.document

    def row(self, process: str) -> Document | None:
        """Return a process' row of the supervisor's table."""
        table = self.document("process_table")
        rows = table["processes"] if table is not None else ()
        return next((row for row in rows if row["name"] == process), None)

    def is_ready(self, process: str) -> bool:
        """Tell whether the supervisor says that a process is at work; nobody watches itself."""
        row = self.row(process)
        return row is not None and row["state"] == "ready"
