"""Remember what is under way: the command that is being planned, the plans that are carried out."""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from typing import Any, Final

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanningResult, Request
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.recovery.setback import Carried, read_setback
from vla_deploy.planning.recovery.strategies import RECOVERY
from vla_deploy.robots.plan_bounds import NOT_BOUNDED

RESTARTED: Final = "the planner was started again meanwhile"
_MOST_REMEMBERED: Final = 16


class ActivePlans:
    """Hold command and plan of what is carried out, with all that failed before.

    For one command, `further_plans` are made at most.
    """

    def __init__(self, further_plans: int = NOT_BOUNDED.further_plans) -> None:
        self._further_plans = further_plans
        self._active: OrderedDict[str, tuple[UserCommand, Carried]] = OrderedDict()

    def add(
        self,
        command: UserCommand,
        plan: Plan,
        answer: PlanningResult,
        agreed: frozenset[str] = frozenset(),
    ) -> None:
        """Note that the executor has a plan: the first for a command, or one after a failure.

        What is `agreed` to with the first counts for all that follow.
        """
        _, before = self._active.pop(command.command_id, (command, None))
        proposal = answer.proposal
        strategy = proposal.origin if proposal is not None and proposal.back_end == RECOVERY else ""
        if command.recovers and before is not None:
            carried = before.going_on(plan, strategy)
        else:
            carried = Carried(plan=plan, given=command.plan is not None, agreed=agreed)
        self._active[command.command_id] = replace(command, recovers=True), carried
        while len(self._active) > _MOST_REMEMBERED:
            self._active.popitem(last=False)

    def agreed(self, command: UserCommand) -> frozenset[str]:
        """Return what the person need not be asked again for another plan of a command."""
        carried = self.of(command.command_id) if command.recovers else None
        return frozenset() if carried is None else carried.agreed

    def of(self, command_id: str) -> Carried | None:
        """Return what is known of a command's plans, None where it is not carried out."""
        known = self._active.get(command_id)
        return None if known is None else known[1]

    def set_back(self, command_id: str, setback: Mapping[str, Any]) -> UserCommand:
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
        if self._further_plans == 0:
            raise CannotBeDone("this robot makes no other plan: [planning] further_plans is 0")
        if len(carried.setbacks) >= self._further_plans:
            plans = "plan" if self._further_plans == 1 else "plans"
            raise CannotBeDone(f"{self._further_plans} other {plans} failed, too")
        self._active[command_id] = command, carried.after(found)
        return command

    def plans(self) -> tuple[Plan, ...]:
        """Return the plans that are carried out."""
        return tuple(carried.plan for _, carried in self._active.values())

    def end(self, command_id: str) -> tuple[UserCommand, Plan] | None:
        """Forget a command that has come to its end; return it with its plan, if it is known."""
        command, carried = self._active.pop(command_id, (None, None))
        return (command, carried.plan) if command and carried else None

    def end_all(self) -> None:
        """Forget all: they are cancelled, so a setback that is still under way starts nothing."""
        self._active.clear()


# --- the command that is being planned ------------------------------------------------------------

# A person who speaks to the robot hears by then that it has heard.
PATIENCE_S: Final = 1.5


@dataclass(slots=True, kw_only=True)
class PlanningJob:
    """Hold a command whose planning takes time."""

    command: UserCommand
    request: Request
    deadline: Deadline
    future: "Future[PlanningResult]"
    patience: Deadline | None

    def result(self) -> PlannedCommand:
        """Return the command with what came of it, once the job is done."""
        return PlannedCommand(self.command, self.request, self.future.result())


class AsyncPlanner:
    """Plan one command at a time in an executor; a step never waits for it."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._job: PlanningJob | None = None

    @property
    def command(self) -> UserCommand | None:
        """Return the command that is being planned."""
        return None if self._job is None else self._job.command

    def begin(
        self,
        command: UserCommand,
        request: Request,
        deadline: Deadline,
        plan: Callable[[], PlanningResult],
    ) -> None:
        """Begin to plan; no other command may be in work."""
        self._job = PlanningJob(
            command=command,
            request=request,
            deadline=deadline,
            future=self._executor.submit(plan),
            patience=Deadline.within(deadline.clock, PATIENCE_S),
        )

    def take_done(self) -> PlanningJob | None:
        """Return the job that is done, once."""
        job = self._job
        if job is None or not job.future.done():
            return None
        self._job = None
        return job

    def take_tedious(self) -> UserCommand | None:
        """Return the command that takes longer than people like to wait in silence, once."""
        job = self._job
        if job is None or job.patience is None or job.patience.left_s > 0.0:
            return None
        job.patience = None
        return job.command

    def call_off(self) -> UserCommand | None:
        """Give up what is being planned, and return the command that it was."""
        job, self._job = self._job, None
        if job is None:
            return None
        job.deadline.call_in()
        return job.command
