"""Measure for how long this computer itself stood still: a robot's own computer never does.

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
from dataclasses import dataclass
from typing import Final

# Above the serial workers and control; below the kernel's own watchdogs at 99.
PRIORITY: Final = 90
FINE_STEP_S: Final = 0.0005
"""Sees nearly every stall that makes a tick late, at the cost of a few hundredths of each core."""
LEAST_NS: Final = 300_000
_MOST: Final = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Stall:
    """Hold when a core should have gone on, on the monotonic clock, and how much later it did.

    It may have stood still for `before_s` longer: from when it was seen at work.
    """

    due_ns: int
    seconds: float
    before_s: float = 0.0


class StillnessWatch:
    """Watch every core from a process of its own, from its start on."""

    def __init__(self, step_s: float) -> None:
        """Start to look each `step_s`; without real-time priority nothing is ever told."""
        pipe = subprocess.PIPE
        self._step_s = step_s
        words = [sys.executable, "-m", "sim_twin.harness.stillness", str(step_s)]
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)

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
