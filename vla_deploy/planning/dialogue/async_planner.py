"""Plan one command outside the node's steps, until it is done or called off."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.interfaces import PlanningResult, Request

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
