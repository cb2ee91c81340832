"""Count the CPU time that a twin spends in physics, in whole steps, and on answering its buses."""

import time
from collections.abc import Callable, Iterator
from typing import Any, Final, ParamSpec, TypeVar

from sim_twin.twin import Twin

_RUN_STEPS: Final = 7

P = ParamSpec("P")
R = TypeVar("R")


def answering(twin: Twin) -> Iterator[tuple[Any, str]]:
    """Yield owner and name of each method by which the twin's devices answer their buses."""
    yield twin.can_wire, "send"
    for device in twin.serial_devices.values():
        yield from ((device, "receive"), (device, "transmit"))


class Stopwatch:
    """Wrap the methods of one twin; the sums are nanoseconds of this thread's CPU time.

    Runs of steps are timed as a whole and by their physics in turns: reading the clock is a system
    call, which must not count as the twin's own work. So `physics_ns` and `step_ns` are each of one
    half of the steps, and the runs are odd, so that no half gets all the steps after a bus cycle.
    """

    def __init__(self, twin: Twin) -> None:
        self.physics_ns = 0
        self.step_ns = 0
        self.answer_ns = 0
        self._steps = 0
        self._whole = False
        self._twin_step = twin.step
        self._physics_step = twin.engine.step
        setattr(twin, "step", self._step)  # noqa: B010 - a method of this one twin
        setattr(twin.engine, "step", self._physics)  # noqa: B010
        for owner, name in answering(twin):
            setattr(owner, name, self._timed(getattr(owner, name)))

    @property
    def physics_ratio(self) -> float:
        """Return the share of the physics in the twin's steps."""
        return self.physics_ns / self.step_ns

    @property
    def physics_ratio_with_answers(self) -> float:
        """Return the share of the physics in what the twin does in steps and between them."""
        return self.physics_ns / (self.step_ns + self.answer_ns / 2)

    def _step(self) -> None:
        self._whole = self._steps // _RUN_STEPS % 2 == 0
        self._steps += 1
        if not self._whole:
            self._twin_step()
            return
        started_ns = time.thread_time_ns()
        self._twin_step()
        self.step_ns += time.thread_time_ns() - started_ns

    def _physics(self) -> None:
        if self._whole:
            self._physics_step()
            return
        started_ns = time.thread_time_ns()
        self._physics_step()
        self.physics_ns += time.thread_time_ns() - started_ns

    def _timed(self, call: Callable[P, R]) -> Callable[P, R]:
        def timed(*args: P.args, **kwargs: P.kwargs) -> R:
            started_ns = time.thread_time_ns()
            result = call(*args, **kwargs)
            self.answer_ns += time.thread_time_ns() - started_ns
            return result

        return timed
