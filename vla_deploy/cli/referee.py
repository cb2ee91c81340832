"""Ask the twin what really happened, while the supervisor goes on with its work."""

import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

from drivers.clock import NS_PER_S
from drivers.twin_clock import TwinClock
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import Session
from vla_deploy.supervisor.supervisor import Supervisor

STEP_NS = NS_PER_S // 20


class SteppingClock:
    """Let the supervisor do its work whenever its own process waits."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.meanwhile: Callable[[], None] = lambda: None
        """What else is done while somebody waits; it must not wait itself."""
        self._clock = supervisor.clock
        self._supervisor = supervisor

    def now_ns(self) -> int:
        """Return the time of the run."""
        return self._clock.now_ns()

    @property
    def stands_still(self) -> bool:
        """Return whether time stands still while nobody waits on this clock: the twin's does."""
        return isinstance(self._clock, TwinClock) and self._clock.page.is_governed

    def sleep_until(self, deadline_ns: int) -> None:
        """Step the supervisor until the deadline.

        Raises:
            KeyboardInterrupt: someone asked the supervisor to stop.
        """
        while True:
            self._supervisor.step()
            self.meanwhile()
            if self._supervisor.stop_requested:
                raise KeyboardInterrupt
            now_ns = self._clock.now_ns()
            if now_ns >= deadline_ns:
                return
            self._clock.sleep_until(min(deadline_ns, now_ns + STEP_NS))


def ask_referee(session: Session, op: str, **details: str) -> dict[str, Any]:
    """Return the referee's answer.

    Raises:
        CommandFailed: it gives no answer.
    """
    words = [word for name, value in details.items() for word in (f"--{name}", value)]
    return answer_of(session, "sim_twin.referee", "--run-dir", str(session.run_dir), op, *words)


def answer_of(session: Session, module: str, *words: str) -> dict[str, Any]:
    """Return what a module of the twin prints; it is started by name: the robot never imports it.

    It may take seconds, in which the robot must not lose its supervisor: on the twin's time these
    are none, where it is the supervisor that asks.

    Raises:
        CommandFailed: it gives no answer.
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
