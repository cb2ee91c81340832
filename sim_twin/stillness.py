"""Tell for how long this computer itself stood still: a robot's own computer never does.

A guest of a busy host loses a core for tens of milliseconds now and then. Only who stands above
every thread of the robot can tell that from a robot that is late by its own fault.
"""

import os
import subprocess
import sys
import threading
import time
from typing import Final

# Above the serial workers and control; below the kernel's own watchdogs at 99.
PRIORITY: Final = 90
STEP_NS: Final = 4_000_000
HELD_UP_S: Final = 0.02
"""With no answer for so much longer, control may rightly take the bus for lost."""


class StillnessWatch:
    """Watch every core from a process of its own, from its start on."""

    def __init__(self) -> None:
        """Start to watch; where the kernel grants no real-time priority, nothing is ever told."""
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            [sys.executable, "-m", "sim_twin.stillness"], stdin=pipe, stdout=pipe, text=True
        )

    def worst_s(self) -> float:
        """Return the longest time a core stood still since the last call."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


def _watch(core: int, worst_ns: dict[int, int]) -> None:
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    while True:
        due_ns = time.monotonic_ns() + STEP_NS
        time.sleep(STEP_NS / 1e9)
        worst_ns[core] = max(worst_ns.get(core, 0), time.monotonic_ns() - due_ns)


def _main() -> None:
    threading.excepthook = lambda _: None  # no priority: nothing to tell
    worst_ns: dict[int, int] = {}
    for core in os.sched_getaffinity(0):
        threading.Thread(target=_watch, args=(core, worst_ns), daemon=True).start()
    for _ in sys.stdin:
        sys.stdout.write(f"{max(worst_ns.values(), default=0) / 1e9}\n")
        sys.stdout.flush()
        worst_ns.clear()


if __name__ == "__main__":
    _main()
