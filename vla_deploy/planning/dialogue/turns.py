"""Decide which command waits for its turn: until the robot is done with what it would disturb."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.dialogue.active_plans import ActivePlans
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import Ambiguous, CommandUnreadable, NotAble, NotUnderstood
from vla_deploy.plans.errors import UnknownObject, UnknownPlace
from vla_deploy.plans.plan import Plan
from vla_deploy.plans.symbolic.simulation import parts_of

ALL: Final = frozenset({"all"})
"""Stands for all parts of the robot, where those that a plan uses are unknown."""
BASE: Final = "base"
_NEVER_BETTER: Final = (
    *(Ambiguous, CommandUnreadable, NotAble, NotUnderstood),
    *(UnknownObject, UnknownPlace),
)
"""What is no better later on: the person has to say more, or something else."""
_VOICE: Final = "speaker"


def parts_of_plan(plan: Plan) -> frozenset[str]:
    """Return the parts of the robot that a plan uses; its voice is shared by all."""
    used = (parts_of(action) for action in plan.actions)
    return frozenset[str]().union(*used) - {_VOICE}


def only_speaks(plan: Plan) -> bool:
    """Return whether a plan does nothing but speak."""
    return all(action.skill == "speak" for action in plan.actions)


@dataclass(frozen=True, slots=True)
class Turn:
    """Hold a command that waits, and how to go on with it."""

    command: UserCommand
    go_on: Callable[[], None]


class Turns:
    """Hold the commands that wait for their turn, in their order."""

    def __init__(self, active: ActivePlans, situation: Situation, events: PlannerEvents) -> None:
        self.waiting: list[Turn] = []
        self._active = active
        self._situation = situation
        self._events = events
        self._told: dict[str, int] = {}
        self._behind: frozenset[str] = frozenset()
        """What was carried out when the last command came to wait."""

    def must_wait(self, done: PlannedCommand) -> bool:
        """Return whether a command is done later: it would disturb what is carried out.

        What is not possible now may be possible then. Only the parts of a mission overtake others.
        """
        command, answer, busy = done.command, done.answer, self._busy
        if command.recovers or done.awaits_word or not (busy or self.waiting):
            return False
        if answer.plan is None:
            return bool(busy) and not isinstance(answer.error, _NEVER_BETTER)
        return self.must_wait_with(command, answer.plan)

    def must_wait_with(self, command: UserCommand, plan: Plan) -> bool:
        """Return whether a command's plan is carried out later."""
        if only_speaks(plan):
            return False
        parts, busy = parts_of_plan(plan), self._busy
        disturbs = busy == ALL or bool(parts & busy)
        if command.mission and busy != ALL:  # the executor gives arms and eyes in their turn
            return disturbs and BASE in parts
        return disturbs or bool(self.waiting) or (bool(busy) and not parts)

    def put_off(self, command: UserCommand, go_on: Callable[[], None]) -> None:
        """Queue a command, and publish its place where that has changed."""
        if not self.waiting:
            self._behind = self._under_way
        self.waiting.append(Turn(command, go_on))
        place = len(self.waiting)
        if self._told.get(command.command_id) == place:
            return
        self._told[command.command_id] = place
        self._events.queued(command, place)
        self._events.say(command, Says.AFTERWARDS)

    def take_due(self) -> list[Turn]:
        """Take out all commands as soon as something else is carried out than when they came."""
        under_way = self._under_way
        if not self.waiting or (under_way and under_way == self._behind):
            return []
        due, self.waiting = self.waiting, []
        names = {one.command.command_id for one in due}
        self._told = {name: place for name, place in self._told.items() if name in names}
        return due

    def drop(self, command_id: str) -> None:
        """Take out one command."""
        self.waiting = [one for one in self.waiting if one.command.command_id != command_id]

    def clear(self) -> list[UserCommand]:
        """Take out all commands."""
        due, self.waiting = self.waiting, []
        self._told.clear()
        return [one.command for one in due]

    @property
    def _under_way(self) -> frozenset[str]:
        """Return the commands that are carried out."""
        return frozenset(self._active.plans) | (self._situation.executing or frozenset())

    @property
    def _busy(self) -> frozenset[str]:
        """Return the parts of the robot that are used by what is carried out."""
        plans = self._active.plans
        if self._under_way - plans.keys():
            return ALL
        return frozenset[str]().union(*map(parts_of_plan, plans.values()))
