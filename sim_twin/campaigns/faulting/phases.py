"""Bring a robot in lock-step into each phase of its work: at rest, driving, reaching, carrying."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from sim_twin.campaigns.faulting.choreography import Phase, choreography_of
from sim_twin.harness.lockstep_stack import LockstepControl

_COMMAND_S: Final = 0.02
_DRIVE_M_S: Final = 0.3
_TURN_RAD_S: Final = 0.9
_TO_THE_WALL_RAD: Final = math.pi / 3
"""From Butler's charger past the plant: the wall comes before the fault's 2 s are over."""
_TURN_TIMEOUT_S: Final = 8.0
_GAZE: Final = {"head_pan": 0.0, "head_tilt": 0.3}
"""As the executor looks where it drives."""
_POSE_S: Final = 3.5
_CLOSE_S: Final = 3.0
_UNDER_WAY: Final = 10
"""Looks until the fingers are surely in motion."""
_FINGERS_REST: Final = 0.02
"""Rad/s, or m/s."""
_SETTLE_S: Final = 1.0
_RUN_UP_S: Final = 0.6
_PAYLOAD_WIDTH_M: Final = 0.025
"""Of a block, in a hand with one jaw that stands fast."""


class NotSet(Exception):
    """Say that the stage could not be set: nothing can be said about the phase."""


class PhaseStage:
    """Own a robot's motions in a phase; control alone is needed, or the whole stack."""

    def __init__(self, stack: LockstepControl) -> None:
        self._stack = stack
        self._lockstep = stack.lockstep
        self.moves = choreography_of(stack.robot)
        self._speeds: tuple[float, float] | None = None
        self._begin: Mapping[Phase, Callable[[], None]] = {
            Phase.IDLE: lambda: None,
            Phase.DRIVING: self._drive_at_the_wall,
            Phase.REACHING: lambda: self._stack.go(self.moves.reach, 0.7),
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
        if self._speeds is None:
            self._lockstep.run_for(seconds)
        else:
            self._stack.drive_for(seconds, *self._speeds)

    @property
    def holds_payload(self) -> bool:
        """Return whether the physics sees the payload in a hand."""
        return self.moves.payload in self._lockstep.truth()["held"]

    def _stand(self, joints: Iterable[str]) -> bool:
        """Return whether fingers have met what stands fast between them."""
        now = self._lockstep.truth()["joints"]
        return all(abs(now[name]["velocity"]) < _FINGERS_REST for name in joints)

    def _drive(self) -> None:
        self._speeds = (_DRIVE_M_S, 0.0)

    def _drive_at_the_wall(self) -> None:
        """Turn to the wall, and drive until something stops the robot: its separation counts."""
        self._stack.go(_GAZE, 1.0)
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
        """Put the payload into the hand, and set off with it."""
        self.take_payload()
        if Phase.DRIVING in self.moves.phases:
            self._drive()
        self._stack.go(self.moves.carry_reach, 0.5)

    def take_payload(self) -> None:
        """Put the payload into the hand, and hold it there until the fingers do.

        Raises:
            NotSet: it did not stay there.
        """
        robot, engine, moves = self._stack.robot, self._lockstep.twin.engine, self.moves
        hand = robot.hands[moves.hand]
        fingers = robot.group(hand.gripper).joints
        limits = [robot.limits[name] for name in fingers]
        open_at = {name: one.max for name, one in zip(fingers, limits, strict=True)}
        shut = {name: max(one.min, 0.004) for name, one in zip(fingers, limits, strict=True)}
        folded = robot.poses[hand.travel_pose] if hand.travel_pose else {}
        self._stack.go({**folded, **moves.hold, **open_at}, 1.0)
        self.run_for(_POSE_S)
        grip = engine.data.site(hand.grip_site)
        self._stack.go(shut, 0.5, dict.fromkeys(fingers, 0.5))
        for look in range(round(_CLOSE_S / _COMMAND_S)):
            self._lockstep.run_for(_COMMAND_S)
            if look > _UNDER_WAY and self.holds_payload and self._stand(fingers):
                break
            aside_m = hand.middle_m(_PAYLOAD_WIDTH_M)
            middle = grip.xpos + aside_m * grip.xmat.reshape(3, 3)[:, 1]
            x_m, y_m, z_m = (float(value) for value in middle)
            engine.place(moves.payload, x_m, y_m, z_m, 0.0)
        self.run_for(_SETTLE_S)
        if not self.holds_payload:
            raise NotSet(f"{moves.payload} at {grip.xpos} did not stay in the {moves.hand} hand")
