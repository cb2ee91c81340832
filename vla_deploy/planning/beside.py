"""Hold the one command that is planned beside the steps, until it is done or called in."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from drivers.clock import Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.interfaces import Answer, Request

# Whoever speaks to the robot hears by then that it has heard.
PATIENCE_S: Final = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """Hold a command that takes time."""

    command: Command
    request: Request
    deadline: Deadline
    future: "Future[Answer]"


class Beside:
    """Do one command's slow planning in an executor; nobody waits for it."""

    def __init__(self, aside: Executor, clock: Clock) -> None:
        self.work: Work | None = None
        self._aside = aside
        self._clock = clock
        self._patience: Deadline | None = None

    def begin(
        self, command: Command, request: Request, deadline: Deadline, plan: Callable[[], Answer]
    ) -> None:
        """Begin to plan; nothing else may be under way."""
        future = self._aside.submit(plan)
        self.work = Work(command=command, request=request, deadline=deadline, future=future)
        self._patience = Deadline.within(self._clock, PATIENCE_S)

    def take_done(self) -> Work | None:
        """Return what has been done, once."""
        work = self.work
        if work is None or not work.future.done():
            return None
        self.work = None
        return work

    def take_tedious(self) -> Command | None:
        """Return the command that takes longer than people like to wait in silence, once."""
        patience = self._patience
        if self.work is None or patience is None or patience.left_s > 0.0:
            return None
        self._patience = None
        return self.work.command

    def call_in(self) -> Command | None:
        """Give up what is under way, and return the command that it was."""
        work, self.work = self.work, None
        if work is None:
            return None
        work.deadline.call_in()
        return work.command
