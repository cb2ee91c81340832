"""Measure perception's real process on the twin, under the profile of the smallest board.

`frame_to_object_*` is from the exposure of an image to the publication of the scene with the things
in it, tracked and placed on the map: transport, the wait for a step, network and geometry. Every
image is searched for obstacles (`images_per_s`), those that were taken while the camera stood still
for things as well (`looks_per_s`). CPU and memory are those of the process as the supervisor
accounts them to its budget. The robot works meanwhile. What the profile asks of hardware that is
not here is taken back: its GPU providers and its cores.
"""

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import psutil

from benchmarks.command import parser, show
from drivers.clock import NS_PER_S
from platforms import Profile, load_profile
from sim_twin.harness.live_robot import PROFILE_FILE, live_stack
from sim_twin.harness.robot import RobotFailed
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.scene import ImageStatus, SightDocument
from vla_deploy.ipc.payloads.supervision import ProcessRow

PROFILE: Final = "jetson_orin_nano"
PROCESS: Final = "perception"
_COMMAND: Final = "pick up the red cup and put it in the box"
# Without a GPU models run on a CPU, and no core can be kept for anybody.
HERE: Final = """inherits = "{profile}"
realtime_required = false
[models.detector]
providers = ["CPUExecutionProvider"]
[processes]
control = {{ affinity = [] }}
perception = {{ affinity = [] }}
planner = {{ affinity = [] }}
speech = {{ affinity = [] }}
executor = {{ affinity = [] }}
recorder = {{ affinity = [] }}
"""


@dataclass(slots=True)
class _Seen:
    """Collect what the scene topic and the process table tell."""

    delays_s: list[float] = field(default_factory=list)
    stamps_ns: set[int] = field(default_factory=set)
    obstacles_ns: set[int] = field(default_factory=set)
    memory_mb: float = 0.0
    sight: SightDocument | None = None
    image: ImageStatus | None = None

    def look(self, session: RobotSession) -> None:
        obstacles, sample = session.fresh(topics.NEAR_OBSTACLES), session.fresh(topics.SCENE)
        if obstacles is not None:
            self.obstacles_ns.add(obstacles.stamp_ns)
        if sample is None:
            return
        document = sample.document()
        self.sight, self.image = document["sight"], document["image"]
        stamp_ns = int(document["stamp_ns"])
        if stamp_ns and stamp_ns not in self.stamps_ns:
            self.stamps_ns.add(stamp_ns)
            self.delays_s.append((sample.stamp_ns - stamp_ns) / NS_PER_S)
        self.memory_mb = max(self.memory_mb, _row(session)["memory_mb"] or 0.0)


def measure(seconds: float = 40.0, profile: str = PROFILE) -> dict[str, Any]:
    """Return delays, rates, CPU and memory of perception while the robot works.

    Raises:
        RobotFailed: the processes do not come up, or perception shows nothing.
    """
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        text = HERE.format(profile=profile)
        with live_stack(Path(folder), text) as robot:
            robot.arm()
            used = load_profile(Path(folder) / PROFILE_FILE)
            return _report(*_watch(robot.session, seconds), used, profile)


def _watch(session: RobotSession, seconds: float) -> tuple[_Seen, float, float]:
    """Let the robot work; return what was seen, and CPU and wall seconds of the span."""
    events = session.command(text=_COMMAND)
    next(events, None)
    seen, pid = _Seen(), _row(session)["pid"] or 0
    began_ns, began_cpu_s = session.clock.now_ns(), _cpu_s(pid)
    while session.clock.now_ns() < began_ns + round(seconds * NS_PER_S):
        seen.look(session)
        session.pause()
    return seen, _cpu_s(pid) - began_cpu_s, (session.clock.now_ns() - began_ns) / NS_PER_S


def _report(
    seen: _Seen, cpu_s: float, elapsed_s: float, profile: Profile, named: str
) -> dict[str, Any]:
    budget, looks = profile.budgets[PROCESS], len(seen.delays_s)
    if seen.sight is None or seen.image is None:
        raise RobotFailed("perception has told no scene")
    model = seen.sight["model"]
    return {
        "profile": named,
        "perception_rate_hz": profile.perception_rate_hz,
        "images_per_s": len(seen.obstacles_ns) / elapsed_s,
        "looks": looks,
        "looks_per_s": looks / elapsed_s,
        "frame_to_object_median_s": float(np.median(seen.delays_s)),
        "frame_to_object_p95_s": float(np.percentile(seen.delays_s, 95)),
        "cpu_per_look_s": cpu_s / max(looks, 1),
        "cpu_ratio": cpu_s / elapsed_s,
        "cpu_used_of_budget": cpu_s / elapsed_s / budget.cpu_ratio,
        "memory_mb": seen.memory_mb,
        "memory_used_of_budget": seen.memory_mb / budget.memory_mb,
        "names_by": seen.sight["mode"],
        "live_provider": model and model["provider"],
        "network_p50_s": model and model["p50_s"],
        "network_p95_s": model and model["p95_s"],
        "late_answers": seen.sight["late"],
        "refused_images": seen.image["refused"],
    }


def _row(session: RobotSession) -> ProcessRow:
    table = session.document(topics.PROCESS_TABLE)
    for row in () if table is None else table["processes"]:
        if row["name"] == PROCESS:
            return row
    raise RobotFailed(f"{PROCESS} is not in the process table")


def _cpu_s(pid: int) -> float:
    return sum(psutil.Process(pid).cpu_times()[:2])


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("perception_live", __doc__)
    arguments.add_argument("--seconds", type=float, default=40.0, help="how long the robot works")
    arguments.add_argument("--profile", default=PROFILE, help="whose rates and budget")
    given = arguments.parse_args(argv)
    show(measure(given.seconds, given.profile), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
