"""Measure how long a serial port's bytes take inside the kernel while others keep all cores busy.

A byte that a servo answers goes to its reader by a kernel worker of ordinary priority. Rounds with
the workers as they are and rounds with the workers raised, as the supervisor raises them, take
turns: a pseudo-terminal, some bytes every period, their reader at control's priority.
`p99_ratio_raised_to_ordinary` compares the two. Both need CAP_SYS_NICE.
"""

import os
import pty
import select
import subprocess
import sys
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from drivers.clock import NS_PER_S, Clock, MonotonicClock
from sim_twin.harness.cores import realtime
from vla_deploy.supervisor.runs.serial_workers import SerialWorkers

_BYTES: Final = bytes(64)
_PERIOD_NS: Final = NS_PER_S // 250
_BUSY_PER_CORE: Final = 8
_SETTLE_NS: Final = NS_PER_S // 2
_QUANTILES: Final = {"p50": 0.5, "p99": 0.99, "p999": 0.999, "worst": 1.0}


def measure(rounds: int, answers: int) -> dict[str, Any]:
    """Return the quantiles of both ways' times, and their ratio."""
    clock, times_s = MonotonicClock(), {"ordinary": np.empty(0), "raised": np.empty(0)}
    with _many_busy(), realtime() as permitted:
        clock.sleep_until(clock.now_ns() + _SETTLE_NS)
        for _ in range(rounds):
            for name, before in times_s.items():
                with _raised(clock) if name == "raised" else nullcontext():
                    times_s[name] = np.append(before, _times_s(clock, answers))
    report: dict[str, Any] = {"answers": rounds * answers, "realtime": permitted}
    for name, found in times_s.items():
        report |= {f"{name}_{q}_s": float(np.quantile(found, at)) for q, at in _QUANTILES.items()}
    report["p99_ratio_raised_to_ordinary"] = report["raised_p99_s"] / report["ordinary_p99_s"]
    return report


def _times_s(clock: Clock, answers: int) -> list[float]:
    """Return how long some bytes took from end to end of a pseudo-terminal, again and again."""
    near, far = pty.openpty()
    times_s = []
    try:
        tty.setraw(far)
        for _ in range(answers):
            begun_ns = clock.now_ns()
            os.write(near, _BYTES)
            _read(far, len(_BYTES))
            times_s.append((clock.now_ns() - begun_ns) / NS_PER_S)
            clock.sleep_until(begun_ns + _PERIOD_NS)
    finally:
        os.close(near)
        os.close(far)
    return times_s


def _read(handle: int, count: int) -> None:
    while count > 0:
        select.select([handle], [], [])
        count -= len(os.read(handle, count))


@contextmanager
def _raised(clock: Clock) -> Iterator[None]:
    workers = SerialWorkers(clock)
    workers.step(wanted=True)
    try:
        yield
    finally:
        workers.close()


@contextmanager
def _many_busy() -> Iterator[None]:
    """Keep more programs busy than there are cores, half of them in sessions of their own."""
    command = [sys.executable, "-c", "while True: pass"]
    count = _BUSY_PER_CORE * len(os.sched_getaffinity(0))
    busy = [subprocess.Popen(command, start_new_session=bool(at % 2)) for at in range(count)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("serial", __doc__)
    arguments.add_argument("--rounds", type=int, default=4, help="of each way")
    arguments.add_argument("--answers", type=int, default=1000, help="of each round")
    options = arguments.parse_args(argv)
    show(measure(options.rounds, options.answers), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
