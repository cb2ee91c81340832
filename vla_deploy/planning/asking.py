"""Say what a planner is asked, what it proposes, and what every rung of the ladder must do."""

from dataclasses import dataclass, field, replace
from typing import Protocol

from vla_deploy.memory.episode import LastSeen
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.model_servers.picture import Image
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.prohibition import Prohibition, StandingOrder
from vla_deploy.planning.understanding.conversation import Conversation
from vla_deploy.world import Snapshot


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Hold one command, with all that may be known when it is planned.

    `here` is the robot's x and y in metres and its yaw in radians, in the map. `recollections` are
    what the robot remembers that may bear on the command, a sentence each; `last_seen` says where
    things were before, the newest first. `heard_confidence`, 0 to 1, is how sure the recogniser is
    of the words; None for typed text. `image` (rows, columns, RGB) is what the robot sees now,
    where a rung can use it. `failed` tells plans for this command that were tried before, and what
    went wrong. `prohibitions` are what people have forbidden for good.
    """

    command_id: str
    text: str
    world: World
    scene: Snapshot | None = None
    here: tuple[float, float, float] | None = None
    conversation: Conversation = field(default_factory=Conversation)
    recollections: tuple[str, ...] = ()
    last_seen: tuple[LastSeen, ...] = ()
    heard_confidence: float | None = None
    image: Image | None = field(default=None, compare=False, repr=False)
    failed: tuple[str, ...] = ()
    prohibitions: tuple[Prohibition, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Sureness:
    """Hold how sure a plan is if its words were heard right, and what to do about less.

    Below `decline_below` it is none; below `read_back_below` the `question` is read back.
    """

    confidence: float
    question: str
    read_back_below: float
    decline_below: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Hold a plan that nobody has checked yet, and which rung made it.

    `confidence` is 0 to 1. Where there is something to `read_back`, it is said, and nothing moves
    before the person agrees; both follow from `sureness`, where there is one, and from how well the
    words were heard. `saw_scene` tells that all of the scene may have shaped the plan, not only the
    words; `is_momentary` that it holds what nobody can compare with later: an answer, or what an
    image showed. `origin` is the rung that made it first, where it was planned before. `covers` are
    the words that change the scope of a command and are represented in the plan, None for all;
    `knows_grammar` tells that whoever made the plan has read the whole sentence. An `order`
    stands once the plan is handed on. With `awaits_word` it is held until the person says go.
    """

    plan: Plan
    rung: str
    confidence: float
    read_back: str = ""
    saw_scene: bool = False
    is_momentary: bool = False
    sureness: Sureness | None = None
    origin: str = ""
    covers: frozenset[str] | None = frozenset()
    knows_grammar: bool = False
    order: StandingOrder | None = None
    awaits_word: bool = False

    def as_heard(self, heard_confidence: float | None) -> "Proposal":
        """Return it as unsure as its words were heard; None for words that were typed.

        Raises:
            Declined: that is too unsure.
        """
        own = self.sureness
        if own is None:
            return self
        confidence = min(own.confidence, 1.0 if heard_confidence is None else heard_confidence)
        if confidence < own.decline_below:
            raise Declined(f"I am not sure of it ({confidence:.2f})")
        read_back = own.question if confidence < own.read_back_below else ""
        return replace(self, confidence=round(confidence, 3), read_back=read_back)


class Rung(Protocol):
    """Plan a command, or decline it so that the next rung is asked."""

    @property
    def name(self) -> str:
        """Return what the rung is called in events and status."""
        ...

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return a plan for the command; nothing moves by that.

        Raises:
            Declined: this rung has no plan for it.
            Ambiguous: only the person can tell what is meant, and is asked.
            PlanningError: this rung cannot plan it; any of the others may.
        """
        ...
