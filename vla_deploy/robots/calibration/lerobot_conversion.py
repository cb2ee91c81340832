"""Turn LeRobot's calibration into ours, and ours into LeRobot's.

LeRobot keeps where a joint's travel begins and ends, in pulses, and writes a homing offset into the
servo; ours keeps the joint's value at one pulse, and writes nothing. The two meet in the pulses
that the servo shows. A body joint is in the middle of its MJCF range where LeRobot has the middle
of its sweep; a gripper is closed at the same end for both, because that is what grips.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from drivers.servo.family import family_of
from drivers.servo.tools.calibration_guide import GuidedJoint
from drivers.servo.tools.travel import CENTRE_PULSE, PULSE_RAD
from vla_deploy.robots.calibration.calibration import JointCalibration, LeRobotOrigin
from vla_deploy.robots.calibration.lerobot_file import TOP_PULSE, LeRobotMotor
from vla_deploy.robots.consistency import unknown_name
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.joint_calibration import guided_joints
from vla_deploy.runtime.table_schema import TableFault

METHOD: Final = "lerobot"
SHORTEST_SWEEP_RATIO: Final = 0.6
"""Of the MJCF range: less was swept by mistake, or is another joint's."""
# LeRobot's half turn: FEETECH shows position - offset, Dynamixel position + offset (feetech.py,
# dynamixel.py `_get_half_turn_homings`).
SHOWN_BY_OFFSET: Final[Mapping[str, int]] = {"feetech": -1, "dynamixel": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class SweptJoint:
    """Hold a joint's range as LeRobot has it, in the pulses of a servo that LeRobot has set up.

    Such a servo shows `shift` pulses less than the servo shows now.
    """

    motor: LeRobotMotor
    shift: int = 0

    @property
    def middle(self) -> float:
        """Return the middle of the range, in the pulses that the servo shows now."""
        return (self.motor.range_min + self.motor.range_max) / 2 + self.shift


def imported(
    robot: RobotDescription,
    motors: Mapping[str, LeRobotMotor],
    present: Mapping[str, JointCalibration],
    homing_in_servo: Mapping[str, bool],
    file: Path,
) -> dict[str, JointCalibration]:
    """Return the calibrations that a file of LeRobot makes, by joint.

    A motor that says what the present calibration says leaves that as it is, to the last digit.
    `homing_in_servo` says of which joints the servo holds the offset of the file.

    Raises:
        RobotFileError: the file does not fit the robot; all faults are listed.
    """
    known = [name for name in motors if name in robot.joint_index]
    joints = {joint.name: joint for joint in guided_joints(robot, known)}
    faults = [
        unknown_name(name, name, "a servo's joint", list(robot.joint_names))
        for name in motors
        if name not in joints
    ]
    as_it_is = exported(robot, present)
    found = {}
    for name, joint in joints.items():
        motor = motors[name]
        if motor == as_it_is[name] and homing_in_servo[name] == _is_in_servo(present.get(name)):
            if name in present:
                found[name] = present[name]
            continue
        swept = SweptJoint(motor=motor, shift=_shift(joint, motor, homing_in_servo[name]))
        faults += _faults(robot, joint, swept)
        found[name] = _calibration(robot, joint, swept, homing_in_servo[name])
    if faults:
        raise RobotFileError(file, tuple(faults))
    return found


def exported(
    robot: RobotDescription,
    calibrations: Mapping[str, JointCalibration],
    homing_offsets: Mapping[str, int] | None = None,
) -> dict[str, LeRobotMotor]:
    """Return LeRobot's view of every joint: as it was imported, of others by their MJCF range.

    `homing_offsets` are those that the servos hold, 0 where they are not known.
    """
    swept = swept_joints(robot, calibrations, homing_offsets or {})
    return {name: one.motor for name, one in swept.items()}


def swept_joints(
    robot: RobotDescription,
    calibrations: Mapping[str, JointCalibration],
    homing_offsets: Mapping[str, int] | None = None,
) -> dict[str, SweptJoint]:
    """Return the range of every joint as LeRobot has it, or would have it."""
    found = {}
    for joint in guided_joints(robot, robot.joint_names):
        calibration = calibrations.get(joint.name)
        origin = None if calibration is None else calibration.lerobot
        if origin is None:
            held = (homing_offsets or {}).get(joint.name, 0)
            found[joint.name] = SweptJoint(motor=_by_range(joint, held))
            continue
        motor = LeRobotMotor(
            id=joint.servo.id,
            drive_mode=origin.drive_mode,
            homing_offset=origin.homing_offset,
            range_min=origin.range_min,
            range_max=origin.range_max,
        )
        shift = _shift(joint, motor, origin.homing_in_servo)
        found[joint.name] = SweptJoint(motor=motor, shift=shift)
    return found


def _is_in_servo(calibration: JointCalibration | None) -> bool:
    origin = None if calibration is None else calibration.lerobot
    return True if origin is None else origin.homing_in_servo


def _shift(joint: GuidedJoint, motor: LeRobotMotor, homing_in_servo: bool) -> int:
    """Return by how much a servo that holds no offset shows more than one that LeRobot set up."""
    family = family_of(joint.servo.model_name).name
    return 0 if homing_in_servo else -SHOWN_BY_OFFSET[family] * motor.homing_offset


def _by_range(joint: GuidedJoint, homing_offset: int) -> LeRobotMotor:
    """Return the pulses at the ends of the MJCF range, both nearer to its middle if need be."""
    per_pulse = _per_pulse(joint)
    middle = CENTRE_PULSE + (joint.range.middle - joint.present.offset) / per_pulse
    half = min(joint.range.pulses / 2, middle, TOP_PULSE - middle)
    return LeRobotMotor(
        id=joint.servo.id,
        drive_mode=0,
        homing_offset=homing_offset,
        range_min=round(middle - half),
        range_max=round(middle + half),
    )


def _calibration(
    robot: RobotDescription, joint: GuidedJoint, swept: SweptJoint, homing_in_servo: bool
) -> JointCalibration:
    motor = swept.motor
    value, pulse = joint.range.middle, swept.middle
    hands = [
        hand for hand in robot.hands.values() if joint.name in robot.group(hand.gripper).joints
    ]
    if hands:
        closes_low = hands[0].opening_ratio > 0.0
        value = joint.range.low if closes_low else joint.range.high
        at_min = closes_low == (joint.present.sign > 0)
        pulse = (motor.range_min if at_min else motor.range_max) + swept.shift
    return JointCalibration(
        servo_id=motor.id,
        sign=joint.present.sign,
        offset=round(value - _per_pulse(joint) * (pulse - CENTRE_PULSE), 6),
        method=METHOD,
        made_at=datetime.now(UTC).isoformat(timespec="seconds"),
        lerobot=LeRobotOrigin(
            drive_mode=motor.drive_mode,
            homing_offset=motor.homing_offset,
            range_min=motor.range_min,
            range_max=motor.range_max,
            homing_in_servo=homing_in_servo,
        ),
    )


def _faults(robot: RobotDescription, joint: GuidedJoint, swept: SweptJoint) -> Iterator[TableFault]:
    motor = swept.motor
    if motor.id != joint.servo.id:
        expected = f"{joint.servo.id}, the id in the robot file"
        yield TableFault(key=f"{joint.name}.id", got=str(motor.id), expected=expected)
    if joint.servo.pulse_rad != PULSE_RAD:
        expected = "a servo that measures a whole turn in 4096 pulses"
        yield TableFault(key=joint.name, got=str(joint.servo), expected=expected)
    span, shortest = motor.range_max - motor.range_min, SHORTEST_SWEEP_RATIO * joint.range.pulses
    if span < shortest:
        expected = f"at least {shortest:.0f} pulses: sweep it from stop to stop in LeRobot again"
        yield TableFault(key=f"{joint.name} range", got=f"{span} pulses", expected=expected)
    offset = _calibration(robot, joint, swept, homing_in_servo=True).offset
    pulses = [CENTRE_PULSE + (limit - offset) / _per_pulse(joint) for limit in joint.limits]
    if min(pulses) < 0 or max(pulses) > TOP_PULSE:
        expected = (
            f"0..{TOP_PULSE} at the joint's limits: let the servo hold LeRobot's homing offset, or "
            "move its horn"
        )
        got = f"{min(pulses):.0f}..{max(pulses):.0f}"
        yield TableFault(key=f"{joint.name} pulses", got=got, expected=expected)


def _per_pulse(joint: GuidedJoint) -> float:
    return joint.present.sign * joint.range.travel_per_rad * PULSE_RAD
