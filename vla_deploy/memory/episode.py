"""Hold what is remembered: commands with what came of them, and things with where they were."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any


def unix_s() -> float:
    """Return seconds since 1970: memories outlive the boot from which other clocks count."""
    return datetime.now(UTC).timestamp()


class EpisodeOutcome(StrEnum):
    """Say what came of a command."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """Hold one command from its words to its end; `told_s` is seconds since 1970.

    `plan` is the plan's document, empty where there was none; `rung` is who planned it. `number` is
    its place in the memory, 0 before it has one.
    """

    told_s: float
    command: str
    outcome: EpisodeOutcome
    source: str = ""
    goal: str = ""
    reasoning: str = ""
    plan: Mapping[str, Any] = field(default_factory=dict)
    rung: str = ""
    error: str = ""
    duration_s: float = 0.0
    number: int = 0

    @property
    def text(self) -> str:
        """Return all of it that words can find."""
        return "\n".join(part for part in (self.command, self.goal, self.error) if part)

    def document(self) -> dict[str, Any]:
        """Return it as the export and `--json` tell it."""
        return {**asdict(self), "outcome": self.outcome.value}


@dataclass(frozen=True, slots=True, kw_only=True)
class LastSeen:
    """Hold where a thing was when it was seen last; `seen_s` is seconds since 1970, map frame.

    `run_id` tells the run in which the thing had that id: ids begin anew with each run.
    """

    run_id: str
    thing_id: str
    kind: str
    colour: str
    place: str
    position_m: tuple[float, float, float]
    seen_s: float

    def __str__(self) -> str:
        return " ".join(word for word in (self.colour, self.kind) if word)

    def document(self) -> dict[str, Any]:
        """Return it as the export and `--json` tell it."""
        return {**asdict(self), "position_m": list(self.position_m)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Recollection:
    """Hold an episode that a question called up, and how well it fits: only good for ranking."""

    episode: Episode
    score: float
