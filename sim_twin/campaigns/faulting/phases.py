"""Bring a robot in lock-step into each phase of its work: at rest, driving, reaching, carrying."""

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Final

from sim_twin.harness.stack import LockstepControl
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.motion import GoalMotion

PAYLOAD: Final = "red_cup"
"""What the left hand carries; its middle is where the hand's grip site is."""
_COMMAND_S: Final = 0.02
_DRIVE_M_S: Final = 0.3
_TURN_RAD_S: Final = 0.9
_TO_THE_WALL_RAD: Final = math.pi / 3
"""From Butler's charger past the plant: the wall comes before the fault's 2 s are over."""
_TURN_TIMEOUT_S: Final = 8.0
_GAZE: Final = {"head_pan": 0.0, "head_tilt": 0.3}
"""As the executor looks where it drives."""
_POSE_S: Final = 3.5
_CLOSE_S: Final = 1.5
_SETTLE_S: Final = 1.0
_RUN_UP_S: Final = 0.6
_POSE: Final = {
    "left_shoulder_yaw": -0.4,
    "left_shoulder_pitch": -0.3,
    "left_elbow": 2.5,
    "left_wrist_pitch": -2.35,
    "left_wrist_roll": 1.57,
    "right_shoulder_yaw": 0.2,
}
"""Butler's left hand before the chest, where its fingers hold the cup from both sides."""
_TUCK: Final = "tuck"
_HAND: Final = "left"
_REACH: Final = {"left_elbow": 1.9, "left_shoulder_pitch": 0.4, "right_elbow": 1.9}
_CARRY_REACH: Final = {"left_elbow": 2.2, "right_elbow": 2.2}


class Phase(Enum):
    """Name what the robot does when something fails."""

    IDLE = "idle"
    DRIVING = "driving"
    REACHING = "reaching"
    CARRYING = "carrying"


class NotSet(Exception):
    """Say that the stage could not be set: nothing can be said about the phase."""


class PhaseStage:
    """Own a robot's motions in a phase; control alone is needed, or the whole stack."""

    def __init__(self, stack: LockstepControl) -> None:
        self._stack = stack
        self._lockstep = stack.lockstep
        self._motions = stack.space.ring_writer(topics.MOTION_COMMAND)
        self._base = stack.space.cell_writer(topics.BASE_COMMAND)
        self._number = 0
        self._speeds: tuple[float, float] | None = None
        self._begin: Mapping[Phase, Callable[[], None]] = {
            Phase.IDLE: lambda: None,
            Phase.DRIVING: self._drive_at_the_wall,
            Phase.REACHING: lambda: self._go(_REACH, 0.7),
            Phase.CARRYING: self._carry,
        }

    def begin(self, phase: Phase) -> None:
        """Arm, and return in the middle of the phase.

        Raises:
            NotSet: the robot stopped, did not turn, or the payload fell, while the stage was set.
        """
        self._stack.arm()
        self._begin[phase]()
        self.run_for(_RUN_UP_S)
        status = self._stack.status()
        if status["state"] != "armed":
            raise NotSet(f"{phase.value}: {status['state']} before any fault: {status['detail']}")

    def run_for(self, seconds: float) -> None:
        """Run on; who drives is told to go on, as the executor would."""
        end_s = self._lockstep.now_s + seconds
        while self._lockstep.now_s < end_s - 1e-9:
            if self._speeds is not None:
                v_m_s, w_rad_s = self._speeds
                self._base.put(v_m_s=v_m_s, w_rad_s=w_rad_s)
            self._lockstep.run_for(min(_COMMAND_S, end_s - self._lockstep.now_s))

    @property
    def holds_payload(self) -> bool:
        """Return whether the physics sees the payload in a hand."""
        return PAYLOAD in self._lockstep.truth()["held"]

    def _drive(self) -> None:
        self._speeds = (_DRIVE_M_S, 0.0)

    def _drive_at_the_wall(self) -> None:
        """Turn to the wall, and drive until something stops the robot: its separation counts."""
        self._go(_GAZE, 1.0)
        self._speeds = (0.0, _TURN_RAD_S)
        end_s = self._lockstep.now_s + _TURN_TIMEOUT_S
        while self._lockstep.truth()["robot"]["yaw_rad"] < _TO_THE_WALL_RAD:
            if self._lockstep.now_s > end_s:
                raise NotSet(f"not turned to the wall within {_TURN_TIMEOUT_S:g} s")
            self.run_for(_COMMAND_S)
        self._speeds = (0.0, 0.0)
        self.run_for(_SETTLE_S)
        self._drive()

    def _carry(self) -> None:
        """Put the payload into the hand, hold it there until the fingers do, and set off."""
        robot, engine = self._stack.robot, self._lockstep.twin.engine
        hand = robot.hands[_HAND]
        fingers = robot.group(hand.gripper).joints
        widest = dict(zip(robot.joint_names, robot.position_max.tolist(), strict=True))
        open_m = {name: widest[name] for name in fingers}
        self._go({**robot.poses[_TUCK], **_POSE, **open_m}, 1.0)
        self.run_for(_POSE_S)
        grip = engine.data.site(hand.grip_site)
        self._go(dict.fromkeys(fingers, 0.004), 0.5, dict.fromkeys(fingers, 0.5))
        for _ in range(round(_CLOSE_S / _COMMAND_S)):
            self._lockstep.run_for(_COMMAND_S)
            if self.holds_payload:
                break
            x_m, y_m, z_m = (float(value) for value in grip.xpos)
            engine.place(PAYLOAD, x_m, y_m, z_m, 0.0)
        self.run_for(_SETTLE_S)
        if not self.holds_payload:
            raise NotSet(f"{PAYLOAD} at {grip.xpos} did not stay in the {_HAND} hand")
        self._drive()
        self._go(_CARRY_REACH, 0.5)

    def _go(
        self, targets: Mapping[str, float], speed: float, effort: Mapping[str, float] | None = None
    ) -> None:
        self._number += 1
        goal: GoalMotion = {
            "kind": "goal",
            "motion_id": self._number,
            "targets": dict(targets),
            "speed_ratio": speed,
        }
        if effort:
            goal["effort_ratio"] = dict(effort)
        self._motions.publish(goal)
