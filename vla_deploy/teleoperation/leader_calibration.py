"""Measure where a leader's joints are and how far they go, as LeRobot does it; nothing is written
to the servos.

The homing offset that LeRobot would write into a servo is only noted in the file: whoever reads
the file compares it with what the servo holds.
"""

from collections.abc import Mapping
from typing import Final

from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.calibration_guide import Person
from drivers.servo.tools.travel import CENTRE_PULSE, PULSES_PER_REV, TravelLog
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.lerobot_conversion import (
    SHORTEST_SWEEP_RATIO,
    SHOWN_BY_OFFSET,
)
from vla_deploy.robots.calibration.lerobot_file import TOP_PULSE, LeRobotMotor
from vla_deploy.robots.joint_calibration import guided_joints
from vla_deploy.teleoperation.errors import LeaderUnusable
from vla_deploy.teleoperation.leader_arm import require_free
from vla_deploy.teleoperation.leader_scale import held_offset

LEAST_GRIPPER_PULSES: Final = 200
"""18 degrees: the handle of a leader goes less far than a gripper."""
_MOST_HOMING: Final = 2047


def calibrated_leader(
    bench: ServoBench, robot: RobotDescription, family: str, person: Person
) -> dict[str, LeRobotMotor]:
    """Let a person hold the leader in the middle, then move all joints from stop to stop.

    Raises:
        LeaderUnusable: it has not one servo for each of the robot's joints, one has torque, or a
            joint was not moved through its travel.
        DriverError: a servo is silent or the link is lost.
    """
    servos = _servos(bench, robot)
    require_free(bench, servos)
    person.wait("hold every joint of the leader in the middle of its travel", lambda: None)
    middle = bench.positions(list(servos.values()))
    silent = [str(servo) for servo in servos.values() if servo.id not in middle]
    if silent:
        raise LeaderUnusable(f"{', '.join(silent)} gave no position; check power and cable")
    sweep = _Sweep(middle)
    person.wait(
        "move every joint from stop to stop, the gripper's handle, too",
        lambda: sweep.feed(bench.positions(list(servos.values()))),
    )
    motors = {
        name: sweep.motor(servo, middle[servo.id], held_offset(bench, servo), family)
        for name, servo in servos.items()
    }
    _require_swept(robot, motors)
    return motors


class _Sweep:
    """Keep how far each servo has gone to either side of where it was."""

    def __init__(self, middle: Mapping[int, int]) -> None:
        self._log = TravelLog(middle)
        self._least = dict.fromkeys(middle, 0)
        self._most = dict.fromkeys(middle, 0)

    def feed(self, positions: Mapping[int, int]) -> None:
        self._log.feed(positions)
        for one in self._least:
            travel = self._log.travel(one)
            self._least[one] = min(self._least[one], travel)
            self._most[one] = max(self._most[one], travel)

    def motor(self, servo: JointServo, shown: int, held: int, family: str) -> LeRobotMotor:
        sign = SHOWN_BY_OFFSET[family]
        actual = (shown - sign * held) % PULSES_PER_REV
        homing = sign * (CENTRE_PULSE - actual)
        return LeRobotMotor(
            id=servo.id,
            drive_mode=0,
            homing_offset=max(-_MOST_HOMING, min(_MOST_HOMING, homing)),
            range_min=max(0, CENTRE_PULSE + self._least[servo.id]),
            range_max=min(TOP_PULSE, CENTRE_PULSE + self._most[servo.id]),
        )


def _servos(bench: ServoBench, robot: RobotDescription) -> dict[str, JointServo]:
    """Return the servos by joint: ids rise along the arm, as the robot's do."""
    found, _ = bench.ask_everyone()
    ids = sorted(one.servo_id for one in found)
    joints = [one.joint for one in sorted(robot.servo_bus.servos, key=lambda one: one.id)]
    if len(ids) != len(joints):
        raise LeaderUnusable(
            f"the leader has servos {', '.join(map(str, ids)) or 'none'}; expected {len(joints)}, "
            f"for {', '.join(joints)}: power, cables, --baud, --family"
        )
    return {joint: bench.servo(one, joint) for joint, one in zip(joints, ids, strict=True)}


def _require_swept(robot: RobotDescription, motors: Mapping[str, LeRobotMotor]) -> None:
    short = []
    for joint in guided_joints(robot, list(motors)):
        motor = motors[joint.name]
        is_gripper = joint.name in robot.gripper_joints
        least = LEAST_GRIPPER_PULSES if is_gripper else SHORTEST_SWEEP_RATIO * joint.range.pulses
        if motor.range_max - motor.range_min < least:
            moved = motor.range_max - motor.range_min
            short.append(f"{joint.name} by {moved} pulses, expected at least {least:.0f}")
    if short:
        raise LeaderUnusable(
            f"not moved from stop to stop: {'; '.join(short)}; nothing was written, do it again"
        )
