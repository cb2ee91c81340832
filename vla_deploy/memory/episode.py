"""Hold what is remembered, and say it: commands and what came of them, things and their places."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Final, Self


def unix_s() -> float:
    """Return seconds since 1970: memories outlive the boot from which other clocks count."""
    return datetime.now(UTC).timestamp()


class EpisodeOutcome(StrEnum):
    """Say what came of a command."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class PastAction:
    """Hold how one action of a command went: what it was about, with which hand, at which place.

    `kind` and `colour` are those of the thing, `hand` the hand that did it; "" is not known.
    """

    skill: str
    succeeded: bool
    kind: str = ""
    colour: str = ""
    hand: str = ""
    place: str = ""
    error: str = ""
    done_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Episode:
    """Hold one command from its words to its end; `told_s` is seconds since 1970.

    `plan` is the plan's document, empty where there was none; `rung` is who planned it. `number` is
    its place in the memory, 0 before it has one. Where a person has corrected the outcome,
    `judged_from` is what the robot had taken it for, and `why` what the person said.
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
    actions: tuple[PastAction, ...] = ()
    judged_from: EpisodeOutcome | None = None
    why: str = ""

    @property
    def text(self) -> str:
        """Return all of it that words can find."""
        return "\n".join(part for part in (self.command, self.goal, self.error, self.why) if part)

    def judged(self, outcome: EpisodeOutcome, why: str = "") -> Self:
        """Return it with the outcome that a person gives it; what the robot saw stays known."""
        seen = self.judged_from or self.outcome
        return replace(
            self, outcome=outcome, judged_from=None if outcome is seen else seen, why=why
        )

    def document(self) -> dict[str, Any]:
        """Return it as the export and `--json` tell it."""
        judged_from = None if self.judged_from is None else self.judged_from.value
        return {**asdict(self), "outcome": self.outcome.value, "judged_from": judged_from}


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


_MINUTE_S: Final = 60.0
_HOUR_S: Final = 3600.0
_DAY_S: Final = 86_400.0
_ENDS: Final = {
    EpisodeOutcome.SUCCEEDED: "and it was done",
    EpisodeOutcome.FAILED: "and it failed",
    EpisodeOutcome.REFUSED: "and it was refused",
}
_JUDGED: Final = {
    EpisodeOutcome.SUCCEEDED: "was right",
    EpisodeOutcome.FAILED: "was wrong",
    EpisodeOutcome.REFUSED: "was to be refused",
}


def ago(elapsed_s: float) -> str:
    """Return how long ago something was: "just now", "5 minutes ago", "2 days ago"."""
    if elapsed_s < _MINUTE_S:
        return "just now"
    for unit_s, limit_s, word in (
        (_MINUTE_S, _HOUR_S, "minute"),
        (_HOUR_S, _DAY_S, "hour"),
        (_DAY_S, float("inf"), "day"),
    ):
        if elapsed_s < limit_s:
            count = int(elapsed_s // unit_s)
            return f"{count} {word}{'s' if count > 1 else ''} ago"
    raise AssertionError("the last unit has no limit")


def sentence_of(episode: Episode, now_s: float) -> str:
    """Return an episode in a sentence."""
    because = f": {episode.error}" if episode.error else ""
    said = f'{ago(now_s - episode.told_s)} I was told "{episode.command}"'
    seen = episode.judged_from or episode.outcome
    judged = ""
    if episode.judged_from is not None or episode.why:
        why = f": {episode.why}" if episode.why else ""
        judged = f"; a person said later that it {_JUDGED[episode.outcome]}{why}"
    return f"{said[0].upper()}{said[1:]} {_ENDS[seen]}{because}{judged}."


def attempt_words(action: PastAction, now_s: float) -> str:
    """Return a past action that failed in a sentence."""
    thing = " ".join(word for word in (action.colour, action.kind) if word)
    parts = (
        action.skill,
        f"of a {thing}" if thing else "",
        f"with my {action.hand} hand" if action.hand else "",
        f"at the {action.place.replace('_', ' ')}" if action.place else "",
    )
    because = f": {action.error}" if action.error else ""
    done = " ".join(part for part in parts if part)
    return f"{ago(now_s - action.done_s).capitalize()} {done} failed{because}."


def place_words(thing: LastSeen, now_s: float) -> str:
    """Return where a thing was in a sentence."""
    return f"I saw the {thing} {at_words(thing.place)}, {ago(now_s - thing.seen_s)}."


def at_words(place: str) -> str:
    """Return where a place is as one says it: "near the kitchen", "in my left hand"."""
    words = place.replace("_", " ")
    for start, said in (("floor near ", "on the floor near the "), ("near ", "near the ")):
        if words.startswith(start):
            return said + words.removeprefix(start)
    return f"in my {words}" if words.endswith(" hand") else f"at the {words}"
