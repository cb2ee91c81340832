"""Group planning errors by what the person who gave the command can do.

PlanError             of vla_deploy.plans.errors, with what is wrong with a plan itself
├── CommandUnreadable give words or a plan, no more than fits
├── NotUnderstood     say it in other words
├── CannotBeDone      ask for something else: a planner has seen that this cannot be done
│   └── NotAble       nor can any other planner: the robot lacks what it takes, or it is not there
├── Declined          ask the next back end: this one has no plan
├── Ambiguous         answer its question; carries the candidates
└── NotReadyToMove    reset and arm the robot first
    └── BatteryLow    let it charge
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from vla_deploy.plans.errors import PlanError

if TYPE_CHECKING:
    from vla_deploy.planning.understanding.conversation import Candidate
    from vla_deploy.plans.knowledge import World


_DRIVING: Final = (
    "go to the kitchen",
    "find the keys",
    "pick up the red cup and put it in the box",
    "bring me the bottle",
    "stop",
)
_MOUNTED: Final = (
    ("find_object", "find the red block"),
    ("place", "put the red block in the bowl"),
    ("open_gripper", "open your hand"),
    ("stop", "stop"),
)
"""What is said to a robot that does not drive, where it has the skill."""


def _examples(world: "World | None") -> Sequence[str]:
    if world is None or "move" in world.skills:
        return _DRIVING
    poses = [f"go to the {min(world.poses).replace('_', ' ')} pose"] if world.poses else []
    return [*(said for skill, said in _MOUNTED if skill in world.skills), *poses]


class CommandUnreadable(PlanError):
    """Say what was expected of a command."""


class NotUnderstood(PlanError):
    """Say that no rule covers the command, and what a robot of this world understands."""

    def __init__(self, text: str, world: "World | None" = None) -> None:
        super().__init__(f'I do not understand "{text}"; try: {", ".join(_examples(world))}')


class CannotBeDone(PlanError):
    """Say why a planner thinks that a command cannot be carried out."""


class NotAble(CannotBeDone):
    """Say what the robot lacks for it, or that nothing such is there, for any planner."""


class Declined(PlanError):
    """Say why one back end has no plan for a command; the next one is asked."""


class Ambiguous(PlanError):
    """Ask the person who gave the command what is meant; the message is the question.

    `expression` is the part of the command that is unclear. Without candidates the answer is yes
    or no.
    """

    def __init__(
        self, question: str, candidates: "Sequence[Candidate]" = (), expression: str = ""
    ) -> None:
        self.question = question
        self.candidates = tuple(candidates)
        self.expression = expression
        super().__init__(question)


class NotReadyToMove(PlanError):
    """Say why the robot may not move now, and what to do about it."""


class BatteryLow(NotReadyToMove):
    """Say that the battery is too low for a plan."""
