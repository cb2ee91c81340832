"""Measure when this computer itself stood still, which makes control late by no fault of its own.

A guest of a busy host loses a core for tens of milliseconds now and then. Only a process above
every thread of the robot can tell that from a robot that is late.
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
STEP_S: Final = 0.0005
"""Sees nearly every stall that makes a tick late, at the cost of a few hundredths of each core."""
LEAST_NS: Final = 300_000
_MOST: Final = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class HostStall:
    """Hold when a core should have gone on, on the monotonic clock, and how much later it did.

    It may have stood still for `STEP_S` longer: from when it was seen at work.
    """

    due_ns: int
    seconds: float


class HostStallMonitor:
    """Watch every core from a process of its own; without real-time priority it sees nothing."""

    def __init__(self) -> None:
        pipe = subprocess.PIPE
        words = [sys.executable, "-m", "sim_twin.campaigns.switching.host_stalls"]
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True)

    def stalls(self) -> tuple[HostStall, ...]:
        """Return every time a core was late by 0.3 ms or more since the last call."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        found = json.loads(self._process.stdout.readline())
        return tuple(HostStall(due_ns=due_ns, seconds=late_ns / 1e9) for due_ns, late_ns in found)

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def _watch(core: int, found: "deque[tuple[int, int]]") -> None:
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    while True:
        due_ns = time.monotonic_ns() + round(STEP_S * 1e9)
        time.sleep(STEP_S)
        late_ns = time.monotonic_ns() - due_ns
        if late_ns >= LEAST_NS:
            found.append((due_ns, late_ns))


def _main() -> None:
    threading.excepthook = lambda _: None  # no priority: nothing to report
    found: deque[tuple[int, int]] = deque(maxlen=_MOST)
    for core in os.sched_getaffinity(0):
        threading.Thread(target=_watch, args=(core, found), daemon=True).start()
    for _ in sys.stdin:
        stalls = [found.popleft() for _ in range(len(found))]
        sys.stdout.write(json.dumps(stalls) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _main()
