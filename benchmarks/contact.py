"""Measure the torque that no contact explains while the robot works, against `[contact]`'s limits.

The whole robot works in lock-step in the twin: friction, payloads and the coarseness of what servos
tell are what is left of the torque. Percentiles are over all jobs, at 50 Hz; the largest value is
told with the share of the limit that it takes.
"""

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.control.judging.contact_torque import ContactTorque
from vla_deploy.ipc import CellReader, topics
from vla_deploy.robots.kinematics.model import RobotModel

JOBS: Final = (
    "pick up the red cup and put it in the box",
    "pick up the book and put it in the box",
    "pick up the bottle and put it in the box",
)
_PERCENTILES: Final = (50, 99, 100)


class TorqueListener:
    """Reckon the unexplained torque as control does, from what control tells of the joints."""

    period_s = 0.004
    ticks_per_look = 5

    def __init__(self, stack: LockstepStack) -> None:
        self.torques_nm: list[np.ndarray] = []
        self._stack = stack
        self._count = len(stack.robot.joint_names)
        self._contact = ContactTorque(stack.robot, RobotModel(stack.robot))
        self._joints: CellReader = stack.space.cell_reader(topics.JOINT_STATE)
        self._ticks = 0

    def start(self) -> None:
        """Have nothing to open."""

    def step(self) -> None:
        """Take in one sample."""
        sample = self._joints.latest()
        if sample is None:
            return
        position, velocity, effort = (
            np.array(sample.data[name][: self._count], dtype=np.float64)
            for name in ("position", "velocity", "effort_ratio")
        )
        self._contact.note(velocity, effort)
        self._ticks += 1
        if self._ticks % self.ticks_per_look:
            return
        torque = self._contact.update(sample.stamp_ns, position)
        if torque is not None:
            self.torques_nm.append(np.abs(torque))

    def stop(self) -> None:
        """Release the topic."""
        self._joints.close()


def measure(jobs: Sequence[str], seed: int) -> dict[str, Any]:
    """Return what became of each job, and each judged joint's percentiles and limit."""
    torques_nm: list[np.ndarray] = []
    told = []
    for job in jobs:
        with _listening(seed) as (stack, listener):
            outcome = stack.say(job)
            told.append({"job": job, **_ending(outcome)})
            torques_nm += listener.torques_nm
    contact = stack.robot.protection.contact
    limits = {} if contact is None else contact.torque_nm
    names = stack.robot.joint_names
    found: np.ndarray = np.percentile(torques_nm, _PERCENTILES, axis=0)
    return {
        "seed": seed,
        "jobs": told,
        "joints": {
            name: _row(found[:, names.index(name)], limit) for name, limit in limits.items()
        },
    }


def _ending(outcome: Mapping[str, Any]) -> dict[str, Any]:
    if outcome["event"] == "rejected":
        return {"success": False, "error": outcome["reason"]}
    return {"success": outcome["success"], "error": outcome["error"]}


def _row(percentiles_nm: np.ndarray, limit_nm: float) -> dict[str, float]:
    middle_nm, high_nm, largest_nm = percentiles_nm.tolist()
    return {
        "p50_nm": round(middle_nm, 3),
        "p99_nm": round(high_nm, 3),
        "max_nm": round(largest_nm, 3),
        "limit_nm": limit_nm,
        "max_of_limit_ratio": round(largest_nm / limit_nm, 3),
    }


@contextmanager
def _listening(seed: int) -> Iterator[tuple[LockstepStack, TorqueListener]]:
    """Own an armed robot whose joints are listened to from then on."""
    with (
        tempfile.TemporaryDirectory() as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        listener = TorqueListener(stack)
        stack.lockstep.add(listener)
        yield stack, listener


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table; 1 where a job failed or a limit was reached."""
    arguments = parser("contact", __doc__)
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--job", action="append", help="a command instead of the usual ones")
    options = arguments.parse_args(argv)
    figures = measure(options.job or JOBS, options.seed)
    show(figures, as_json=options.json, text=_text)
    reached = any(row["max_of_limit_ratio"] >= 1.0 for row in figures["joints"].values())
    failed = any(not job["success"] for job in figures["jobs"])
    return 1 if reached or failed else 0


def _text(figures: dict[str, Any]) -> str:
    lines = [f"{job['job']}: {job['error'] or 'done'}" for job in figures["jobs"]]
    lines.append(f"{'joint':24}{'p50':>8}{'p99':>8}{'max':>8}{'limit':>8}  max of limit")
    lines += [
        f"{name:24}{row['p50_nm']:8.2f}{row['p99_nm']:8.2f}{row['max_nm']:8.2f}"
        f"{row['limit_nm']:8.2f}{row['max_of_limit_ratio']:8.2f}"
        for name, row in figures["joints"].items()
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
