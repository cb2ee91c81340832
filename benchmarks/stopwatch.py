"""Count the CPU time that a twin spends in physics, in whole steps, and on answering its buses."""

import time
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from sim_twin.twin import Twin

P = ParamSpec("P")
R = TypeVar("R")


class Stopwatch:
    """Wrap the methods of one twin; the sums are nanoseconds of this thread's CPU time."""

    def __init__(self, twin: Twin) -> None:
        self._spent_ns = {"physics": 0, "step": 0, "answer": 0}
        watched = (
            ("physics", twin.engine, "step"),
            ("step", twin, "step"),
            ("answer", twin.can_wire, "send"),
            *(("answer", device, "receive") for device in twin.serial_devices.values()),
            *(("answer", device, "transmit") for device in twin.serial_devices.values()),
        )
        for account, owner, name in watched:
            setattr(owner, name, self._timed(account, getattr(owner, name)))

    @property
    def physics_ns(self) -> int:
        """Return what `mj_step` took."""
        return self._spent_ns["physics"]

    @property
    def step_ns(self) -> int:
        """Return what the twin's steps took, physics included."""
        return self._spent_ns["step"]

    @property
    def answer_ns(self) -> int:
        """Return what the devices took to answer, outside the steps."""
        return self._spent_ns["answer"]

    def _timed(self, account: str, call: Callable[P, R]) -> Callable[P, R]:
        spent_ns = self._spent_ns

        def timed(*args: P.args, **kwargs: P.kwargs) -> R:
            started_ns = time.thread_time_ns()
            result = call(*args, **kwargs)
            spent_ns[account] += time.thread_time_ns() - started_ns
            return result

        return timed
