"""Ask the robot, by the release that it runs, whether it can be reached, ticks, and stands still.

The question goes through that release's own command line, as a person's would: the layout of the
shared memory may differ from ours, the document of `status --json` only grows.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from vla_deploy.install.commands import run_command
from vla_deploy.install.errors import SystemCommandFailed

Report = Mapping[str, Any]
# Above what an encoder at rest reports: a Dynamixel counts speed in steps of 0.024 rad/s.
_JOINT_RAD_S: Final = 0.05
_BASE_M_S: Final = 0.01
_BASE_RAD_S: Final = 0.05
_AT_WORK: Final = ("executing", "recovering")


def robot_report(program: Path, runtime: Path) -> Report:
    """Return the status of the robot that runs in `runtime`, as a release's program has it.

    Raises:
        SystemCommandFailed: the robot is not reached.
    """
    command = (str(program), "--runtime-base", str(runtime), "status", "--json")
    text = run_command(command)
    try:
        report = json.loads(text)
    except json.JSONDecodeError as error:
        raise SystemCommandFailed(f"`{' '.join(command)}`: cannot read its answer") from error
    if not isinstance(report, dict):
        raise SystemCommandFailed(f"`{' '.join(command)}`: expected a JSON object")
    return report


def tick_of(report: Report) -> int | None:
    """Return how many ticks control has made, None where it is silent."""
    control = report.get("control")
    return int(control["tick"]) if control else None


def moving_in(report: Report) -> str:
    """Return what moves or is about to, "" for a robot at rest.

    A control that is silent cannot say so: what its joints do is unknown.
    """
    control, executor = report.get("control"), report.get("executor") or {}
    if not control:
        return "control is silent, so what its joints do is unknown"
    motion = report.get("motion") or {}
    base, joint = motion.get("base") or {}, motion.get("joint") or {}
    found = {
        "control is stopping": control.get("state") == "stopping",
        f"motions {control.get('active_motions')}": bool(control.get("active_motions")),
        f"mission {', '.join(motion.get('missions') or ())}": bool(motion.get("missions")),
        f"skill {executor.get('skill') or '?'}": executor.get("state") in _AT_WORK,
        f"the base at {base}": base.get("speed_m_s", 0.0) > _BASE_M_S
        or abs(base.get("w_rad_s", 0.0)) > _BASE_RAD_S,
        f"joint {joint.get('number')} at {joint.get('velocity')} rad/s": joint.get("velocity", 0.0)
        > _JOINT_RAD_S,
    }
    return "; ".join(words for words, holds in found.items() if holds)
