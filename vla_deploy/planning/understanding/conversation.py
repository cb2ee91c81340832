"""Remember the last turns of a conversation: what was said, meant, mentioned, and what happened.

A conversation is a value: each event gives a new one, so a plan can be explained by what it saw.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import words_of
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.plans.symbolic.state import Pose, subject_or_none
from vla_deploy.world import Snapshot, Thing
from vla_deploy.world.vocabulary import ANY_CLASS, COLOURS, OBJECT_CLASSES, SYNONYMS

MOST_TURNS: Final = 5
# Whoever has not answered by then has gone on to something else.
ANSWER_LIMIT_S: Final = 20.0


class MentionRole(StrEnum):
    """Name the part that something mentioned plays in a command."""

    OBJECT = "object"
    DESTINATION = "destination"
    PLACE = "place"


class TurnOutcome(StrEnum):
    """Hold how a turn ended, or that it has not."""

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
    `thing_id` the thing of the scene that was meant, "" where the scene does not tell.
    """

    said: str
    means: str
    role: MentionRole = MentionRole.OBJECT
    thing_id: str = ""
    kind: str = ""
    colour: str = ""

    @classmethod
    def of(cls, thing: Thing, said: str = "", role: MentionRole = MentionRole.OBJECT) -> "Mention":
        """Return the mention of a thing of the scene, by its own words if it was not called."""
        return cls(
            said=said or str(thing),
            means=str(thing),
            role=role,
            thing_id=thing.thing_id,
            kind=thing.kind,
            colour=thing.colour,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ConversationTurn:
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
    outcome: TurnOutcome = TurnOutcome.UNDER_WAY
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
    command_text: str = ""
    expression: str = ""
    candidates: tuple[Candidate, ...] = ()
    choices: Mapping[str, str] = field(default_factory=dict)
    limit_s: float = ANSWER_LIMIT_S

    def is_open(self, now_ns: int) -> bool:
        """Return whether an answer would still be taken."""
        return now_ns - self.asked_ns <= self.limit_s * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversation:
    """Hold the last turns, the newest last.

    `choices` maps expressions of the command being planned to what the speaker said they mean.
    """

    turns: tuple[ConversationTurn, ...] = ()
    choices: Mapping[str, str] = field(default_factory=dict)

    def after(self, turn: ConversationTurn) -> "Conversation":
        """Add a turn, or put it in the place of the one with its command id; forget the oldest."""
        others = tuple(
            one for one in self.turns if not turn.command_id or one.command_id != turn.command_id
        )
        return replace(self, turns=(*others, turn)[-MOST_TURNS:])

    def ended(self, command_id: str, outcome: TurnOutcome, answer: str = "") -> "Conversation":
        """Note how a turn ended; one that is forgotten changes nothing."""
        turns = tuple(
            replace(one, outcome=outcome, answer=answer or one.answer)
            if one.command_id == command_id
            else one
            for one in self.turns
        )
        return replace(self, turns=turns)

    def mentions(self) -> tuple[Mention, ...]:
        """Return everything mentioned, the newest first; of one turn, the last words first."""
        return tuple(one for turn in reversed(self.turns) for one in reversed(turn.mentioned))


# --- what a plan is about, so that the next command can say "it", "there" and "the other one" -----

MOST_LETTERS: Final = 400


def mentions_of(plan: Plan, scene: Snapshot | None) -> tuple[Mention, ...]:
    """Return what a grounded plan names, in its order, each once."""
    found: dict[tuple[str, str], Mention] = {}
    put_to = {action.parameters.get("destination") for action in plan.actions}
    for action in plan.actions:
        values = (action.parameters.get(name) for name in ("object", "destination", "place"))
        named = [
            _mention(
                value, MentionRole.DESTINATION if value in put_to else MentionRole.OBJECT, scene
            )
            for value in values
            if isinstance(value, str)
        ]
        for mention in (*_put_from_hand(action, plan, scene), *named):
            found.setdefault((mention.means, mention.thing_id), mention)
    return tuple(found.values()) or tuple(_spoken(plan.goal, scene))


def _spoken(goal: str, scene: Snapshot | None) -> Iterator[Mention]:
    """Yield the things that a command names whose plan only answers it: "where is my phone?"."""
    colour = ""
    for word in words_of(goal[:MOST_LETTERS]):
        name = SYNONYMS.get(word, word)
        if name in OBJECT_CLASSES and name != ANY_CLASS:
            yield _mention(f"{colour} {name}", MentionRole.OBJECT, scene)
        colour = name if name in COLOURS else ""


def _put_from_hand(action: Action, plan: Plan, scene: Snapshot | None) -> Iterator[Mention]:
    """Yield what a plan puts down that the hand had before; its actions do not name it."""
    if action.skill != "place" or scene is None:
        return
    arm = action.parameters.get("arm")
    taken = any(one.skill == "pick_up" for one in plan.actions[: plan.actions.index(action)])
    held = [one for one in scene.things if one.held_by and arm in (None, one.held_by)]
    if len(held) == 1 and not taken:
        yield Mention.of(held[0], held[0].thing_id)


def _mention(said: str, role: MentionRole, scene: Snapshot | None) -> Mention:
    """Return the mention of a thing, or of a place; what is driven to, to put there, is put to."""
    subject = subject_or_none(said, scene)
    if subject is None:
        return Mention(said=said, means=said, role=MentionRole.PLACE)
    if subject.thing is not None:
        return Mention.of(subject.thing, said, role)
    return Mention(said=said, means=subject.words, role=role, kind=subject.kind)
