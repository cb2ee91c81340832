"""Write a topic as control does, until SIGTERM."""

import signal
from collections.abc import Callable
from pathlib import Path

from drivers.clock import MonotonicClock
from vla_deploy.ipc import SharedSpace

BEAT_S = 0.02


def beat(run_dir: Path, what: str, announce: Callable[[], None]) -> None:
    space = SharedSpace(run_dir / "ipc", MonotonicClock())
    base, status = space.cell_writer("base_state"), space.cell_writer("control_status")
    tick = 0
    while signal.sigtimedwait({signal.SIGTERM, signal.SIGINT}, BEAT_S) is None:
        tick += 5
        base.commit()
        if what == "control":
            status.put_document(control_status(run_dir, tick))
        if tick == 5:
            announce()
    raise SystemExit(0)


def control_status(run_dir: Path, tick: int) -> dict:
    """Return what control tells; files in the run's directory make it tell trouble."""
    lost = (run_dir / "bus-lost").exists()
    unjudged = 10 if (run_dir / "safety-silent").exists() else 0
    return {
        "tick": tick,
        "judged_tick": tick - unjudged,
        "late_ticks": 0,
        "estop_latched": False,
        "buses": {"servos": {"budget": {"bus": "lost" if lost else "ok", "lost": []}}},
    }
