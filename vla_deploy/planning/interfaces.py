"""Define what passes between the planner's parts, and what every back end does."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum, StrEnum
from typing import Any, Protocol

from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.ipc.payloads.tasks import ActionStatusName, AttemptDocument
from vla_deploy.memory.experience import NO_EXPERIENCE, Experience
from vla_deploy.model_servers.calls.picture import Image
from vla_deploy.planning.errors import Ambiguous, NotAble
from vla_deploy.planning.understanding.conversation import Conversation
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import Plan
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.world import Snapshot


class Forbidden(StrEnum):
    """Name what may be forbidden."""

    THING = "thing"
    PLACE = "place"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prohibition:
    """Hold what is forbidden: the words for a thing, or the name of a place."""

    what: Forbidden
    words: str

    def __str__(self) -> str:
        """Return it as one says it."""
        named = self.words.replace("_", " ")
        verb = "touch the" if self.what is Forbidden.THING else "go into the"
        return f"{verb} {named}"


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingOrder:
    """Hold a command that forbids something, or permits it again."""

    forbids: bool
    of: Prohibition

    @property
    def answer(self) -> str:
        """Return what the robot says to it."""
        return f"All right, I will {'not' if self.forbids else 'now'} {self.of}."

    @property
    def question(self) -> str:
        """Return what is asked before it stands; to forbid something is safe at once."""
        return "" if self.forbids else f"May I {self.of} again?"


class Aid(Enum):
    """Name what some back ends can use, and what takes time to get."""

    IMAGE = "what the camera sees"
    MEMORY = "what is remembered of earlier commands"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionNote:
    """Hold how one of the last actions ended."""

    skill: str
    parameters: Mapping[str, Any]
    status: ActionStatusName
    error: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """Hold one command, with all that may be known when it is planned.

    `here` is the robot's x and y in metres and its yaw in radians, in the map. `experience` is what
    the robot remembers that may bear on the command. `task` is what is carried out now, in words,
    "" for nothing; `last_actions` are those that ended last, the newest first. `battery` is
    None where nothing tells of it. `heard_confidence`, 0 to 1, is how sure the recogniser is of the
    words; None for typed text. `image` (rows, columns, RGB) is what the robot sees now, where a
    back end can use it. `failed` describes plans for this command that were tried before, and what
    went wrong. `prohibitions` are what people have forbidden for good.
    """

    command_id: str
    text: str
    world: World
    scene: Snapshot | None = None
    here: tuple[float, float, float] | None = None
    conversation: Conversation = field(default_factory=Conversation)
    experience: Experience = NO_EXPERIENCE
    task: str = ""
    last_actions: tuple[ActionNote, ...] = ()
    heard_confidence: float | None = None
    image: Image | None = field(default=None, compare=False, repr=False)
    failed: tuple[str, ...] = ()
    prohibitions: tuple[Prohibition, ...] = ()
    battery: BatteryDocument | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Hold a plan that is not checked yet, and which back end made it.

    `confidence` is 0 to 1. Where the back end `is_unsure`, or words of the command are `left_out`,
    nothing moves before the person agrees. `origin` is the strategy that made a plan after a
    failure. `covers` are the words that change the scope of a command and are represented in the
    plan, None for all; `knows_grammar` is set where the back end has read the whole sentence. An
    `order` stands once the plan is dispatched. With `awaits_word` it is held until the person says
    go.
    """

    plan: Plan
    back_end: str
    confidence: float
    is_unsure: bool = False
    left_out: tuple[str, ...] = ()
    origin: str = ""
    covers: frozenset[str] | None = frozenset()
    knows_grammar: bool = False
    order: StandingOrder | None = None
    awaits_word: bool = False

    @property
    def is_read_back(self) -> bool:
        """Return whether a person must agree to the plan first, whatever it risks."""
        asks = self.order is not None and bool(self.order.question)
        return self.is_unsure or bool(self.left_out) or asks


class AttemptOutcome(StrEnum):
    """Say what came of asking one back end."""

    PLANNED = "planned"
    ASKED = "asked"
    INVALID = "invalid"
    REFUSED = "refused"
    DECLINED = "declined"
    LATE = "late"


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """Hold what one back end said to a command, and how long that took."""

    back_end: str
    outcome: AttemptOutcome
    took_s: float
    reason: str = ""

    def document(self) -> AttemptDocument:
        """Return it as JSON takes it."""
        document: AttemptDocument = {
            "rung": self.back_end,
            "outcome": self.outcome.value,
            "took_s": round(self.took_s, 4),
        }
        return {**document, "reason": self.reason} if self.reason else document


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningResult:
    """Hold what came of a command: a `plan` that may run, or why there is none.

    `proposal` is the plan as its back end proposed it, before it was grounded and checked.
    `is_unchecked` is set while a language model has still to check what the plan moves.
    """

    attempts: tuple[Attempt, ...] = ()
    plan: Plan | None = None
    proposal: Proposal | None = None
    error: PlanError | None = None
    is_unchecked: bool = False

    @property
    def is_final(self) -> bool:
        """Return whether no other back end needs to be asked."""
        return self.plan is not None or isinstance(self.error, Ambiguous | NotAble)


Check = Callable[[Plan, PlanRequest], Plan]
"""Return a proposed plan grounded and checked, or raise the PlanError that says why it may not
run."""


class BackEnd(Protocol):
    """Plan a command, or decline it so that the next back end is asked.

    `name` is what it is called in events and status, `uses` what its prompts can hold. One that
    `is_language_model` is asked before the others that take time, and checks what quicker ones
    plan.
    """

    name: str
    is_language_model: bool = False
    uses: frozenset[Aid] = frozenset()

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        """Return a plan for the command; nothing moves by that.

        Raises:
            Declined: this back end has no plan for it.
            Ambiguous: only the person knows what is meant, and is asked.
            PlanError: this back end cannot plan it; any of the others may.
        """
        ...

    def document(self) -> dict[str, Any] | None:
        """Return how its server has been doing, None where it has none."""
        return None

    def close(self) -> None:
        """Release what it holds in memory."""
        return  # most hold nothing
