"""Measure from a command to the first motion, on the real processes and the twin.

`typed_to_plan_*` is from the utterance in its ring to the plan in the executor's, as those who talk
to the robot wait for it: the planner's sleep between steps is in it. `typed_to_motion_*` ends where
wheels or joints are first told to be faster than while they rest; `spoken_to_motion_*` begins where
the last word ends in the room of the twin. `*_planned` and `*_moved` count what came at all, not
whether it was what was said.
Memory and CPU are the planner's, as the supervisor accounts them to its budget. The machine runs
the physics too, so these are upper bounds.
"""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.percentiles import spread_s
from benchmarks.perception_live import HERE
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.harness.live_robot import PROFILE_FILE, live_stack
from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.robot import RobotFailed
from vla_deploy.ipc import topics

PROFILE: Final = "jetson_orin_nano"
ACCOUNTED: Final = ("planner", "speech")
COMMANDS: Final = (
    "turn left thirty degrees", "look to the left", "turn right thirty degrees",
    "look to the right", "go to the kitchen", "find the red cup", "move forward ten centimetres",
    "go to the charging station",
)  # fmt: skip
MOTION_RAD_S, MOTION_M_S = 0.05, 0.02
STILL_S: Final = 1.0
ANSWER_S: Final = 6.0
REST_S: Final = 30.0
_LOOK_S: Final = 0.004


class _Robot:
    """Watch a running robot from outside: its plans, and whether it moves."""

    def __init__(self, stack: ProcessStack) -> None:
        self.stack = stack
        self._session = stack.session
        self._plans = self._session.events(topics.PLAN)

    def rest(self) -> None:
        """End what is under way, and wait until nothing has moved for a while.

        Raises:
            RobotFailed: the robot goes on moving, or control does not arm.
        """
        self._session.utter(cancel=True)
        clock = self.stack.clock
        still_since_ns = began_ns = clock.now_ns()
        while (now_ns := clock.now_ns()) < still_since_ns + round(STILL_S * NS_PER_S):
            if now_ns > began_ns + round(REST_S * NS_PER_S):
                raise RobotFailed(f"the robot does not come to rest within {REST_S:g} s")
            if self.moves():
                still_since_ns = now_ns
            self.stack.pause(_LOOK_S)
        self.stack.arm()
        self._plans.drain()

    def moves(self) -> bool:
        """Return whether a wheel or a joint is faster than while the robot rests."""
        joints, base = (
            self._session.fresh(topics.JOINT_STATE),
            self._session.fresh(topics.BASE_STATE),
        )
        if joints is None or base is None:
            return False
        count = int(joints.data["joint_count"])
        turns = float(np.abs(np.asarray(joints.data["velocity"])[:count]).max()) > MOTION_RAD_S
        drives = abs(float(base.data["v_m_s"])) > MOTION_M_S
        return turns or drives or abs(float(base.data["w_rad_s"])) > MOTION_RAD_S

    def type(self, text: str) -> int:
        """Give a command in words; return when."""
        now_ns = self.stack.clock.now_ns()
        self._session.utter(text=text)
        return now_ns

    def speak(self, text: str) -> int:
        """Let somebody in the room say it; return when the last word ends, host's time."""
        return int(self.stack.speak(text)["ended_ns"])

    def follow(self, began_ns: int) -> tuple[float | None, float | None]:
        """Return how long the plan, and then the motion, took to come; None where none did."""
        clock, planned_s = self.stack.clock, None
        while clock.now_ns() < began_ns + round(ANSWER_S * NS_PER_S):
            for event in self._plans.drain():
                if "plan" in event.payload:
                    planned_s = (event.stamp_ns - began_ns) / NS_PER_S
            if planned_s is not None and self.moves():
                return planned_s, (clock.now_ns() - began_ns) / NS_PER_S
            self.stack.pause(_LOOK_S)
        return planned_s, None


def measure(rounds: int = 1, spoken: bool = True, profile: str = PROFILE) -> dict[str, Any]:
    """Return delays of typed and spoken commands, CPU and memory of the planner.

    Raises:
        RobotFailed: the processes do not come up.
    """
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        text = HERE.format(profile=profile)
        with live_stack(Path(folder), text) as stack:
            stack.arm()
            robot = _Robot(stack)
            texts = COMMANDS * rounds
            report = _delays("typed", texts, robot, robot.type)
            if spoken:
                report |= _delays("spoken", texts, robot, robot.speak)
            return report | _cost(stack, Path(folder) / PROFILE_FILE, profile)


def _delays(
    how: str, texts: Sequence[str], robot: _Robot, give: Callable[[str], int]
) -> dict[str, Any]:
    plans_s, motions_s = [], []
    for text in texts:
        robot.rest()
        planned_s, moved_s = robot.follow(give(text))
        plans_s += [] if planned_s is None else [planned_s]
        motions_s += [] if moved_s is None else [moved_s]
    return {
        f"{how}_commands": len(texts),
        f"{how}_planned": len(plans_s),
        f"{how}_moved": len(motions_s),
        **spread_s(f"{how}_to_plan", plans_s),
        **spread_s(f"{how}_to_motion", motions_s),
    }


def _cost(stack: ProcessStack, path: Path, named: str) -> dict[str, Any]:
    """Return memory and CPU of speech and planner as the supervisor accounts them, at the end."""
    budgets = load_profile(path).budgets
    report: dict[str, Any] = {"profile": named}
    for name in ACCOUNTED:
        usage = stack.row(name)
        for key, budget in (
            ("memory_mb", budgets[name].memory_mb),
            ("cpu_ratio", budgets[name].cpu_ratio),
        ):
            report[f"{name}_{key}"] = usage[key]
            report[f"{name}_{key}_of_budget"] = usage[key] and usage[key] / budget
    return report
