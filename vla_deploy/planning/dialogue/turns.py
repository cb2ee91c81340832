"""Decide which command waits for its turn: until the robot is done with what it would disturb."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final

from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.errors import Ambiguous, CommandUnreadable, NotAble, NotUnderstood
from vla_deploy.plans.errors import UnknownObject, UnknownPlace
from vla_deploy.plans.plan import Plan
from vla_deploy.plans.symbolic.simulation import parts_of

ALL: Final = frozenset({"all"})
"""What is under way while nobody knows which parts of the robot a plan uses."""
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


@dataclass(slots=True)
class Turns:
    """Hold the commands that wait for their turn, in their order."""

    waiting: list[Turn] = field(default_factory=list)
    _told: dict[str, int] = field(default_factory=dict)
    _busy: object = None

    def must_wait(self, done: PlannedCommand, busy: frozenset[str]) -> bool:
        """Return whether a command is done later; `busy` are the parts that plans under way use.

        What is not possible now may be possible then. Only the parts of a mission overtake others.
        """
        command, answer = done.command, done.answer
        if command.recovers or done.awaits_word or not (busy or self.waiting):
            return False
        if answer.plan is None:
            return bool(busy) and not isinstance(answer.error, _NEVER_BETTER)
        return self.must_wait_with(command, answer.plan, busy)

    def must_wait_with(self, command: UserCommand, plan: Plan, busy: frozenset[str]) -> bool:
        """Return whether a command's plan is carried out later."""
        if only_speaks(plan):
            return False
        parts = parts_of_plan(plan)
        disturbs = busy == ALL or bool(parts & busy)
        if command.mission and busy != ALL:  # the executor gives arms and eyes in their turn
            return disturbs and BASE in parts
        return disturbs or bool(self.waiting) or (bool(busy) and not parts)

    def add(self, command: UserCommand, go_on: Callable[[], None], busy: object) -> int | None:
        """Let a command wait; return its place where that is news, 1 first."""
        self.waiting.append(Turn(command, go_on))
        self._busy = busy
        place, before = len(self.waiting), self._told.get(command.command_id)
        self._told[command.command_id] = place
        return None if place == before else place

    def take_due(self, busy: object) -> Iterator[Turn]:
        """Take out all commands as soon as something else is under way than when they came."""
        if not self.waiting or busy == self._busy:
            return iter(())
        due, self.waiting = self.waiting, []
        names = {one.command.command_id for one in due}
        self._told = {name: place for name, place in self._told.items() if name in names}
        return iter(due)

    def drop(self, command_id: str) -> None:
        """Take out one command."""
        self.waiting = [one for one in self.waiting if one.command.command_id != command_id]

    def clear(self) -> list[UserCommand]:
        """Take out all commands."""
        due, self.waiting = self.waiting, []
        self._told.clear()
        return [one.command for one in due]
