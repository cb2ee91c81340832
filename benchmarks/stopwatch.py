"""Count the CPU time that a twin spends in physics, in whole steps, and on answering its buses."""

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Hold the sums of one round of steps, in nanoseconds of CPU time."""

    physics_ns: int
    step_ns: int
    answer_ns: int


class Stopwatch:
    """Wrap the methods of one twin; the sums are nanoseconds of this thread's CPU time.

    Runs of steps are timed as a whole and by their physics in turns: reading the clock is a system
    call, which must not count as the twin's own work. So `physics_ns` and `step_ns` are each of one
    half of the steps, and the runs are odd, so that no half gets all the steps after a bus cycle.
    What neighbours on the machine put out of the caches makes Python slower than the physics, so
    the ratios are those of the round whose steps took the least; `lap` ends a round.
    """

    def __init__(self, twin: Twin) -> None:
        self.physics_ns = 0
        self.step_ns = 0
        self.answer_ns = 0
        self._rounds: list[Round] = []
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
        best = min(self._rounds, key=lambda one: one.step_ns)
        return best.physics_ns / best.step_ns

    @property
    def physics_ratio_median(self) -> float:
        """Return the median of that share over all rounds."""
        return statistics.median(one.physics_ns / one.step_ns for one in self._rounds)

    @property
    def physics_ratio_with_answers(self) -> float:
        """Return the share of the physics in what the twin does in steps and between them."""
        best = min(self._rounds, key=lambda one: one.step_ns)
        return best.physics_ns / (best.step_ns + best.answer_ns / 2)

    def lap(self) -> None:
        """End a round of as many steps as the others."""
        self._rounds.append(
            Round(physics_ns=self.physics_ns, step_ns=self.step_ns, answer_ns=self.answer_ns)
        )
        self.physics_ns = self.step_ns = self.answer_ns = 0

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
