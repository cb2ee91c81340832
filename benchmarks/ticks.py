"""Count control's late ticks: idle and with all cores kept busy, with and without SCHED_FIFO.

A tick is late when it begins more than a fifth of the period after it should have, as control
itself counts it. Robot, drivers and twin are the real processes; the twin stands for the hardware
and so has a real-time priority of its own wherever the machine permits.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, show
from benchmarks.core import REALTIME_PRIORITY, busy_cores, realtime, write_profile
from sim_twin.process_stack import ProcessStack
from vla_deploy.cli.session import Session

_PRIORITIES: Final = {"plain": 0, "fifo": REALTIME_PRIORITY}
_SETTLE_S: Final = 2.0


def measure(seconds: float) -> dict[str, Any]:
    """Return the share of late ticks of each combination."""
    with realtime() as permitted:
        pass
    report: dict[str, Any] = {"seconds": seconds, "realtime": permitted}
    for name, priority in _PRIORITIES.items():
        if priority and not permitted:
            report |= {f"late_ratio_{name}_{load}": None for load in ("idle", "loaded")}
            continue
        with tempfile.TemporaryDirectory(prefix="vla-") as folder:
            report |= _measure(Path(folder), name, priority, seconds)
    return report


def _measure(folder: Path, name: str, priority: int, seconds: float) -> dict[str, Any]:
    profile = write_profile(folder, priority)
    stack = ProcessStack(folder / "run", "--profile", str(profile))
    try:
        stack.wait_until_armed()
        session = Session(stack.run_dir)
        idle = _late_ratio(session, seconds)
        with busy_cores():
            loaded = _late_ratio(session, seconds)
        session.close()
    finally:
        stack.close()
    return {f"late_ratio_{name}_idle": idle, f"late_ratio_{name}_loaded": loaded}


def _late_ratio(session: Session, seconds: float) -> float:
    session.pause(_SETTLE_S)
    before = session.document("control_status") or {}
    session.pause(seconds)
    after = session.document("control_status") or {}
    ticks = after["tick"] - before["tick"]
    return float((after["late_ticks"] - before["late_ticks"]) / ticks)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("ticks", __doc__)
    arguments.add_argument("--seconds", type=float, default=20.0, help="of each combination")
    options = arguments.parse_args(argv)
    show(measure(options.seconds), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
