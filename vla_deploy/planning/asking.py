"""Say what a planner is asked, what it proposes, and what every rung of the ladder must do."""

from dataclasses import dataclass, field
from typing import Protocol

from vla_deploy.memory.episode import LastSeen
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.model_servers.picture import Image
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Plan
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
    went wrong.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Hold a plan that nobody has checked yet, and which rung made it.

    `confidence` is 0 to 1. Where there is something to `read_back`, it is said, and nothing moves
    before the person agrees. `saw_scene` tells that all of the scene may have shaped the plan, not
    only the words. `origin` is the rung that made it first, where it was planned before.
    """

    plan: Plan
    rung: str
    confidence: float
    read_back: str = ""
    saw_scene: bool = False
    origin: str = ""


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
