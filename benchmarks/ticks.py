"""Count control's late ticks: idle and with all cores kept busy, with and without SCHED_FIFO.

A tick is late when it begins more than a fifth of the period after it should have, as control
itself counts it. Robot, drivers and twin are the real processes; the twin stands for the hardware
and so has a real-time priority of its own wherever the machine permits. `late_ratio_bare_...` is
the yardstick: a loop that only sleeps runs beside control for as long, at its rate and priority,
and is counted in the same way. What is late there, no program on this machine can do on time.
"""

import sys
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, show
from drivers.clock import NS_PER_S, Clock
from platforms import load_profile
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.harness.cores import REALTIME_PRIORITY, busy_cores, realtime
from sim_twin.harness.live_robot import live_robot
from sim_twin.harness.processes import ProcessStack
from vla_deploy.control.reporting.telemetry import TickClock
from vla_deploy.ipc import topics

_PRIORITIES: Final = {"plain": 0, "fifo": REALTIME_PRIORITY}
_LOADS: Final = ("idle", "loaded")
_ROWS: Final = ("late_ratio", "late_ratio_bare")
_SETTLE_S: Final = 2.0
_PERIOD_S: Final = 1.0 / load_profile("desktop").control_rate_hz


def measure(seconds: float) -> dict[str, Any]:
    """Return the share of late ticks of each combination."""
    with realtime() as permitted:
        pass
    report: dict[str, Any] = {"seconds": seconds, "realtime": permitted}
    for name, priority in _PRIORITIES.items():
        if priority and not permitted:
            report |= {f"{row}_{name}_{load}": None for row in _ROWS for load in _LOADS}
            continue
        with tempfile.TemporaryDirectory(prefix="vla-") as folder:
            report |= _measure(Path(folder), name, priority, seconds)
    return report


def _measure(folder: Path, name: str, priority: int, seconds: float) -> dict[str, Any]:
    with live_robot(folder, priority) as robot, realtime() if priority else nullcontext():
        robot.arm()
        idle = _late_ratios(robot, seconds)
        with busy_cores():
            loaded = _late_ratios(robot, seconds)
    return {
        f"{row}_{name}_{load}": ratio
        for load, ratios in zip(_LOADS, (idle, loaded), strict=True)
        for row, ratio in zip(_ROWS, ratios, strict=True)
    }


def _late_ratios(robot: ProcessStack, seconds: float) -> tuple[float, float]:
    """Return the shares of control's late ticks and of the bare loop's."""
    robot.pause(_SETTLE_S)
    before = TickWatch.of(robot.document(topics.CONTROL_STATUS))
    bare = sleep_bare(robot.clock, _PERIOD_S, seconds)
    ticks = TickWatch.of(robot.document(topics.CONTROL_STATUS)).since(before)
    return ticks.late_ratio, bare.late_ticks / bare.tick


def sleep_bare(clock: Clock, period_s: float, seconds: float) -> TickClock:
    """Sleep from tick to tick as control does, do nothing else, and return the count."""
    ticks = TickClock(period_s)
    period_ns = round(period_s * NS_PER_S)
    deadline_ns = clock.now_ns()
    for _ in range(round(seconds / period_s)):
        ticks.begin(clock.now_ns())
        deadline_ns = max(deadline_ns + period_ns, clock.now_ns())
        clock.sleep_until(deadline_ns)
    return ticks


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("ticks", __doc__)
    arguments.add_argument("--seconds", type=float, default=20.0, help="of each combination")
    options = arguments.parse_args(argv)
    show(measure(options.seconds), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
