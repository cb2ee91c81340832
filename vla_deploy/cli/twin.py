"""Send requests to the twin of a run, and keep the supervisor at work while one is answered."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from drivers.clock import NS_PER_S
from drivers.twin_clock import TwinClock
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import RobotSession
from vla_deploy.client.unix_rpc import request

if TYPE_CHECKING:
    from vla_deploy.supervisor.supervisor import Supervisor

_SOCKET: Final = Path("dev") / "referee"
_STEP_NS: Final = NS_PER_S // 20


def has_twin(run_dir: Path) -> bool:
    """Return whether the run's robot is a twin."""
    return (run_dir / _SOCKET).is_socket()


def ask_twin(run_dir: Path, op: str, **details: Any) -> dict[str, Any]:
    """Return the twin's answer to a request that it answers at once.

    Raises:
        UsageError: the run has no twin, or the twin refuses.
        CommandFailed: the twin does not answer.
    """
    path = run_dir / _SOCKET
    if not has_twin(run_dir):
        raise UsageError(
            f"this run has no twin ({path} is not there), and this is for the twin alone; "
            "start one: vla-deploy run --twin"
        )
    try:
        answer = request(path, {"op": op, **details})
    except OSError as error:
        raise CommandFailed(f"{path}: {error.strerror or error}; is the twin alive?") from error
    if not answer.pop("ok"):
        raise UsageError(f"the twin refuses: {answer['error']}")
    return answer


class SteppingClock:
    """Step the supervisor whenever its own process waits."""

    def __init__(self, supervisor: "Supervisor") -> None:
        self.meanwhile: Callable[[], None] = lambda: None
        """Also called at every step of a wait; it must not wait itself."""
        self._clock = supervisor.clock
        self._supervisor = supervisor

    def now_ns(self) -> int:
        """Return the time of the run."""
        return self._clock.now_ns()

    @property
    def stands_still(self) -> bool:
        """Return whether time stands still unless this clock waits, as the twin's time does."""
        return isinstance(self._clock, TwinClock) and self._clock.page.is_governed

    def sleep_until(self, deadline_ns: int) -> None:
        """Step the supervisor until the deadline.

        Raises:
            KeyboardInterrupt: the supervisor was asked to stop.
        """
        while True:
            self._supervisor.step()
            self.meanwhile()
            if self._supervisor.stop_requested:
                raise KeyboardInterrupt
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                return
            self._clock.sleep_until(min(deadline_ns, now_ns + _STEP_NS))


def ask_referee(session: RobotSession, op: str, **details: str) -> dict[str, Any]:
    """Return the answer of the twin's referee.

    Raises:
        CommandFailed: it gives no answer.
    """
    words = [word for name, value in details.items() for word in (f"--{name}", value)]
    return answer_of(session, "sim_twin.referee", "--run-dir", str(session.run_dir), op, *words)


def answer_of(session: RobotSession, module: str, *words: str) -> dict[str, Any]:
    """Return the JSON output of a module of the twin; a process of its own, never an import.

    It may take seconds, in which the session waits so that the supervisor goes on; where the
    supervisor itself asks and time stands still meanwhile, there is nothing to step.

    Raises:
        CommandFailed: it fails.
    """
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-m", module, *words],
        stdout=pipe,
        stderr=pipe,
        text=True,
        start_new_session=True,
    ) as asked:
        try:
            clock = session.clock
            stands_still = isinstance(clock, SteppingClock) and clock.stands_still
            while not stands_still and asked.poll() is None:
                session.pause()
            answer_text, complaint = asked.communicate()
        except BaseException:
            asked.kill()
            raise
    if asked.returncode != 0:
        raise CommandFailed(complaint.strip() or f"{module} failed with {words}")
    answer: dict[str, Any] = json.loads(answer_text)
    return answer
