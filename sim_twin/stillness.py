"""Tell for how long this computer itself stood still: a robot's own computer never does.

A guest of a busy host loses a core for tens of milliseconds now and then. Only who stands above
every thread of the robot can tell that from a robot that is late by its own fault.
"""

import json
import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Final

import psutil

# Above the serial workers and control; below the kernel's own watchdogs at 99.
PRIORITY: Final = 90
STEP_S: Final = 0.004
FINE_STEP_S: Final = 0.0005
"""Sees nearly every stall that makes a tick late, at the cost of a few hundredths of each core."""
LEAST_NS: Final = 300_000
_MOST: Final = 10_000
HELD_UP_S: Final = 0.02
"""With no answer for so much longer, control may rightly take the bus for lost."""
TOGETHER_S: Final = 0.05
"""Control's patience with a servo, `SafetyLimits.servo_age_s`: what comes later stands apart."""
STOLEN_RATIO: Final = 0.1
"""With less left of the cores than the rest of this, a robot may rightly not keep its rates."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stall:
    """Tell when a core should have gone on, on the monotonic clock, and how much later it did.

    It may have stood still for `before_s` longer: from when it was seen at work.
    """

    due_ns: int
    seconds: float
    before_s: float = 0.0


class StillnessWatch:
    """Watch every core from a process of its own, from its start on."""

    def __init__(self, step_s: float = STEP_S) -> None:
        """Start to look each `step_s`; without real-time priority nothing is ever told."""
        pipe = subprocess.PIPE
        self._step_s = step_s
        words = [sys.executable, "-m", "sim_twin.stillness", str(step_s)]
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)

    def worst_s(self) -> float:
        """Return the most that cores stood still within any `TOGETHER_S` since the last call."""
        return worst_together_s(self.stalls())

    def stalls(self) -> tuple[Stall, ...]:
        """Return every time a core was late by 0.3 ms or more since the last call."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        told = json.loads(self._process.stdout.readline())
        return tuple(
            Stall(due_ns=due_ns, seconds=late_ns / 1e9, before_s=self._step_s)
            for due_ns, late_ns in told
        )

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


class StolenTime:
    """Tell which share of all cores the host has given to others, as the kernel counts it.

    Slices of a millisecond are no stall, and yet leave a robot less than the computer it was made
    for (`steal`, proc_stat(5)).
    """

    def __init__(self) -> None:
        self._before_s = _stolen_and_all_s()

    def ratio(self) -> float:
        """Return the share since the last call, from 0 to 1."""
        stolen_s, all_s = now = _stolen_and_all_s()
        before, self._before_s = self._before_s, now
        return (stolen_s - before[0]) / max(1e-9, all_s - before[1])


def _stolen_and_all_s() -> tuple[float, float]:
    times = psutil.cpu_times()
    # The kernel counts a guest's time as user's, too.
    return times.steal, sum(times) - times.guest - times.guest_nice


def worst_together_s(stalls: Sequence[Stall]) -> float:
    """Return the most that cores stood still within any `TOGETHER_S`.

    A servo's answer passes from core to core: what one after the other holds it up adds up. Two
    that stand still at once count once.
    """
    together_ns = round(TOGETHER_S * 1e9)
    window: deque[tuple[int, int]] = deque()
    within_ns = worst_ns = 0
    for at_ns, end_ns in _spells(stalls):
        window.append((at_ns, end_ns - at_ns))
        within_ns += end_ns - at_ns
        while at_ns - window[0][0] >= together_ns:
            within_ns -= window.popleft()[1]
        worst_ns = max(worst_ns, within_ns)
    return worst_ns / 1e9


def _spells(stalls: Sequence[Stall]) -> list[tuple[int, int]]:
    """Return when any core stood still, each time once: begin and end."""
    spells: list[tuple[int, int]] = []
    for stall in sorted(stalls, key=attrgetter("due_ns")):
        end_ns = stall.due_ns + round(stall.seconds * 1e9)
        if spells and stall.due_ns <= spells[-1][1]:
            spells[-1] = (spells[-1][0], max(spells[-1][1], end_ns))
        else:
            spells.append((stall.due_ns, end_ns))
    return spells


def _watch(core: int, step_s: float, found: "deque[tuple[int, int]]") -> None:
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    while True:
        due_ns = time.monotonic_ns() + round(step_s * 1e9)
        time.sleep(step_s)
        late_ns = time.monotonic_ns() - due_ns
        if late_ns >= LEAST_NS:
            found.append((due_ns, late_ns))


def _main(step_s: float) -> None:
    threading.excepthook = lambda _: None  # no priority: nothing to tell
    found: deque[tuple[int, int]] = deque(maxlen=_MOST)
    for core in os.sched_getaffinity(0):
        threading.Thread(target=_watch, args=(core, step_s, found), daemon=True).start()
    for _ in sys.stdin:
        told = [found.popleft() for _ in range(len(found))]
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _main(float(sys.argv[1]))
