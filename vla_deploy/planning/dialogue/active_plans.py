"""Remember what is under way: the command that is being planned, the plans that are carried out."""

from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Executor, Future
from dataclasses import replace
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc.payloads.tasks import SetbackEvent
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanningResult
from vla_deploy.planning.recovery.setback import Carried, read_setback
from vla_deploy.planning.recovery.strategies import RECOVERY
from vla_deploy.plans.plan import Plan
from vla_deploy.robots.plan_bounds import NOT_BOUNDED
from vla_deploy.runtime.deadline import Deadline

RESTARTED: Final = "the planner was started again meanwhile"
LOST_NS: Final = 3 * NS_PER_S
"""For so long the executor's status, ten a second, may leave out a command."""
_MOST_REMEMBERED: Final = 16


class ActivePlans:
    """Hold command and plan of what is carried out, with all that failed before.

    For one command, `further_plans` are made at most.
    """

    def __init__(self, further_plans: int = NOT_BOUNDED.further_plans) -> None:
        self._further_plans = further_plans
        self._active: dict[str, tuple[UserCommand, Carried]] = {}
        self._since_ns: dict[str, int] = {}

    def __bool__(self) -> bool:
        """Return whether any plan is carried out."""
        return bool(self._active)

    @property
    def plans(self) -> Mapping[str, Plan]:
        """Return the plan of each command that is carried out."""
        return {name: carried.plan for name, (_, carried) in self._active.items()}

    def lost(self, named: Collection[str], now_ns: int) -> list[str]:
        """Return the commands that the executor has not named for too long."""
        for name in self._active:
            if name in named:
                self._since_ns[name] = now_ns
        return [name for name in self._active if now_ns - self._since_ns[name] > LOST_NS]

    def add(
        self,
        command: UserCommand,
        plan: Plan,
        answer: PlanningResult,
        now_ns: int,
        agreed: frozenset[str] = frozenset(),
    ) -> None:
        """Note that the executor has a plan: the first for a command, or one after a failure.

        What is `agreed` to with the first counts for all that follow.
        """
        before, proposal = self.of(command.command_id), answer.proposal
        self.end(command.command_id)
        if command.recovers and before is not None:
            is_mended = proposal is not None and proposal.back_end == RECOVERY
            carried = before.going_on(plan, proposal.origin if proposal and is_mended else "")
        else:
            carried = Carried(plan=plan, given=command.plan is not None, agreed=agreed)
        self._active[command.command_id] = replace(command, recovers=True), carried
        self._since_ns[command.command_id] = now_ns
        while len(self._active) > _MOST_REMEMBERED:
            del self._active[next(iter(self._active))]

    def agreed(self, command: UserCommand) -> frozenset[str]:
        """Return what the person need not be asked again for another plan of a command."""
        carried = self.of(command.command_id) if command.recovers else None
        return frozenset() if carried is None else carried.agreed

    def of(self, command_id: str) -> Carried | None:
        """Return what is known of a command's plans, None where it is not carried out."""
        known = self._active.get(command_id)
        return None if known is None else known[1]

    def set_back(self, command_id: str, setback: SetbackEvent) -> UserCommand:
        """Note that a plan failed, and return the command to plan anew.

        Raises:
            CannotBeDone: no other plan is made; says why.
        """
        known = self._active.get(command_id)
        found = None if known is None else read_setback(setback, known[1].plan)
        if known is None or found is None:
            raise CannotBeDone(RESTARTED)
        command, carried = known
        if carried.given:
            raise CannotBeDone("the plan was given, and is not changed")
        if len(carried.setbacks) >= self._further_plans:
            raise CannotBeDone(
                f"[planning] further_plans of the robot file allows {self._further_plans} other "
                "plans, and no more"
            )
        self._active[command_id] = command, carried.after(found)
        return command

    def end(self, command_id: str) -> tuple[UserCommand, Plan] | None:
        """Forget a command that has come to its end; return it with its plan, if it is known."""
        known = self._active.pop(command_id, None)
        self._since_ns.pop(command_id, None)
        return None if known is None else (known[0], known[1].plan)

    def end_all(self) -> None:
        """Forget all: they are cancelled, so a setback that is still under way starts nothing."""
        self._active.clear()


# --- the command that is being planned ------------------------------------------------------------

# A person who speaks to the robot hears by then that it has heard.
PATIENCE_S: Final = 1.5


class AsyncPlanner:
    """Plan one `command` at a time in an executor; a step never waits for it."""

    def __init__(self, executor: Executor) -> None:
        self.command: UserCommand | None = None
        self._executor = executor
        self._deadline: Deadline | None = None
        self._patience: Deadline | None = None
        self._future: Future[PlannedCommand] | None = None

    def begin(
        self, command: UserCommand, deadline: Deadline, plan: Callable[[], PlannedCommand]
    ) -> None:
        """Begin to plan; no other command may be in work."""
        self.command, self._deadline = command, deadline
        self._patience = Deadline.within(deadline.clock, PATIENCE_S)
        self._future = self._executor.submit(plan)

    def take_done(self) -> "Future[PlannedCommand] | None":
        """Return what came of the command, once, as soon as it is planned."""
        future = self._future
        if future is None or not future.done():
            return None
        self.command = self._future = None
        return future

    def take_tedious(self) -> UserCommand | None:
        """Return the command that takes longer than people like to wait in silence, once."""
        if self._patience is None or self._patience.left_s > 0.0:
            return None
        self._patience = None
        return self.command

    def call_off(self) -> UserCommand | None:
        """Give up what is being planned, and return the command that it was."""
        command, self.command = self.command, None
        if self._deadline is not None:
            self._deadline.call_in()
        self._future = None
        return command
