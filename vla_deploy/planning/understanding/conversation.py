"""Remember the last turns of a conversation: what was said, meant, mentioned, and what happened.

A conversation is a value: each event gives a new one, so a plan can be explained by what it saw.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.planning.plan import Plan
from vla_deploy.world import Thing

MOST_TURNS: Final = 5
# Whoever has not answered by then has gone on to something else.
ANSWER_LIMIT_S: Final = 20.0

Pose = tuple[float, float, float]


class Role(StrEnum):
    """Name the part that something mentioned plays in a command."""

    OBJECT = "object"
    DESTINATION = "destination"
    PLACE = "place"


class Outcome(StrEnum):
    """Tell how a turn ended, or that it has not."""

    UNDER_WAY = "under way"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    REFUSED = "refused"
    CANCELLED = "cancelled"
    ASKED = "asked"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mention:
    """Hold one thing or place that a turn was about.

    `said` is how it was called, `means` the words or the place that plans use for it, and
    `thing_id` the thing of the scene that was meant, "" where the scene does not tell. `rested` is
    what it was on or in at that time: a place, or the id of a thing.
    """

    said: str
    means: str
    role: Role = Role.OBJECT
    thing_id: str = ""
    kind: str = ""
    colour: str = ""
    rested: str = ""

    @classmethod
    def of(cls, thing: Thing, said: str = "", role: Role = Role.OBJECT) -> "Mention":
        """Return the mention of a thing of the scene, by its own words if it was not called."""
        return cls(
            said=said or str(thing),
            means=str(thing),
            role=role,
            thing_id=thing.thing_id,
            kind=thing.kind,
            colour=thing.colour,
            rested="" if thing.rests is None else thing.rests.of,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """Hold one command, what the robot answered to it, and the plan that came of it or None.

    `understood` is the command as the plan sums it up; `here` is where the robot stood (x, y, yaw
    in the map) when it was told.
    """

    said: str
    command_id: str = ""
    told_ns: int = 0
    understood: str = ""
    mentioned: tuple[Mention, ...] = ()
    plan: Plan | None = None
    outcome: Outcome = Outcome.UNDER_WAY
    answer: str = ""
    here: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Offer one answer: `name` goes into the plan, `words` into the question.

    `features` are the words by which an answer may call it: "red", "left", "second".
    """

    name: str
    words: str
    features: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """Hold what the robot asked; the next utterance is its answer.

    Without candidates it is answered by yes or no. `command_text` is the command that waits for
    the answer, `expression` the words of it that were unclear, `choices` what was settled before.
    """

    text: str
    asked_ns: int
    command_id: str = ""
    command_text: str = ""
    expression: str = ""
    candidates: tuple[Candidate, ...] = ()
    choices: Mapping[str, str] = field(default_factory=dict)
    limit_s: float = ANSWER_LIMIT_S

    def is_open(self, now_ns: int) -> bool:
        """Tell whether an answer would still be taken."""
        return now_ns - self.asked_ns <= self.limit_s * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversation:
    """Hold the last turns, the newest last, and the question that waits for an answer.

    `choices` maps expressions of the command being planned to what the speaker said they mean.
    """

    turns: tuple[Turn, ...] = ()
    question: Question | None = None
    choices: Mapping[str, str] = field(default_factory=dict)

    def after(self, turn: Turn) -> "Conversation":
        """Add a turn, or put it in the place of the one with its command id; forget the oldest."""
        others = tuple(
            one for one in self.turns if not turn.command_id or one.command_id != turn.command_id
        )
        return replace(self, turns=(*others, turn)[-MOST_TURNS:])

    def ended(self, command_id: str, outcome: Outcome, answer: str = "") -> "Conversation":
        """Note how a turn ended; one that is forgotten changes nothing."""
        turns = tuple(
            replace(one, outcome=outcome, answer=answer or one.answer)
            if one.command_id == command_id
            else one
            for one in self.turns
        )
        return replace(self, turns=turns)

    def asks(self, question: Question) -> "Conversation":
        """Wait for an answer; an older question is dropped."""
        return replace(self, question=question, choices={})

    def settled(self, choices: Mapping[str, str] | None = None) -> "Conversation":
        """Wait for no answer any more, with what the speaker chose."""
        return replace(self, question=None, choices=MappingProxyType(dict(choices or {})))

    def mentions(self) -> tuple[Mention, ...]:
        """Return everything mentioned, the newest first; of one turn, the last words first."""
        return tuple(one for turn in reversed(self.turns) for one in reversed(turn.mentioned))
