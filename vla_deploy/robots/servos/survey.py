"""Judge the servos of a robot as they are found on the wire, before there is torque.

`servo scan` and `doctor` do this; control's own connect makes those of the checks that belong to a
family. Nothing is written.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.scan import SpeedReport, is_model
from drivers.servo.trouble import ServoTrouble, TroubleLevel
from vla_deploy.robots.calibration.calibration import CALIBRATION_FILE, read_calibration
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.servos.declared import servo_specs
from vla_deploy.robots.supplies import voltage_mismatches

REST_POSE: Final = "rest"
_LEANING: Final = 0.05
"""How far beyond its limits a joint may lean, as a share of their range (chosen)."""
_AT_REST_RAD: Final = 0.3
_OFF_REST_RAD: Final = 0.5
"""Shafts this near to the pose at rest lie there, those this far from it do not (chosen)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSurvey:
    """Hold what was found; `volts` are by servo id."""

    troubles: tuple[ServoTrouble, ...]
    wrong_voltages: tuple[str, ...]
    volts: Mapping[int, float]


def survey(robot: RobotDescription, bench: ServoBench, report: SpeedReport) -> ServoSurvey:
    """Read the servos of a robot that answered as what they are declared, and judge them.

    Raises:
        LinkLost: the adapter is gone.
    """
    found = {one.servo_id: one.model_name for one in report.servos}
    servos = [
        servo
        for servo in servo_specs(robot)
        if servo.id in found and is_model(found[servo.id], servo.model_name)
    ]
    if not servos:
        return ServoSurvey(troubles=(), wrong_voltages=(), volts={})
    readings = bench.read_servos(servos, {})
    volts = {reading.id: reading.voltage_v for reading in readings}
    wrong_voltages = voltage_mismatches(robot.servo_bus, volts)
    supplies = (
        ServoTrouble(
            measured=mismatch,
            remedy="check converter, plugs and robot file; servos of a higher voltage are damaged",
            level=TroubleLevel.FAULT,
        )
        for mismatch in wrong_voltages
    )
    pulses = bench.positions(servos)
    let_go = not any(reading.torque_on for reading in readings)
    return ServoSurvey(
        troubles=(
            *supplies,
            *bench.examine(servos),
            *homing_troubles(robot, servos, bench.homing_offsets(servos)),
            *pose_troubles(robot, servos, pulses, let_go=let_go),
        ),
        wrong_voltages=tuple(wrong_voltages),
        volts=volts,
    )


def homing_troubles(
    robot: RobotDescription, servos: Sequence[JointServo], held: Mapping[int, int]
) -> Iterator[ServoTrouble]:
    """Compare the homing offsets in the servos with those at the robot's calibration."""
    calibrations = read_calibration(robot.folder / CALIBRATION_FILE)
    expected = {
        name: one.expected_homing_offset
        for name, one in calibrations.items()
        if one.expected_homing_offset is not None
    }
    for servo in servos:
        if servo.joint in expected and held.get(servo.id) not in (None, expected[servo.joint]):
            yield ServoTrouble(
                measured=f"{servo}: expected homing offset {expected[servo.joint]}, as calibrated, "
                f"got {held[servo.id]}: something wrote it since, and the joint is off by it",
                remedy="import LeRobot's file again (`vla-deploy servo calibration import`), or "
                "`vla-deploy servo calibrate`",
                level=TroubleLevel.FAULT,
            )
    unknown = [
        f"{servo.joint} {held[servo.id]}"
        for servo in servos
        if held.get(servo.id) and servo.joint not in calibrations
    ]
    if unknown:
        yield ServoTrouble(
            measured=f"homing offsets are set in servos that were not calibrated here: "
            f"{', '.join(unknown)}",
            remedy="import LeRobot's, `vla-deploy servo calibration import`, or servo calibrate",
            level=TroubleLevel.NOTE,
        )


def pose_troubles(
    robot: RobotDescription,
    servos: Sequence[JointServo],
    pulses: Mapping[int, int],
    *,
    let_go: bool,
) -> Iterator[ServoTrouble]:
    """Name joints that cannot stand where their servos say, and those that look exchanged.

    Where the arm has been let go, `let_go`, it may lie as the robot file's pose at rest says: two
    joints that do not, but would if their ids were exchanged, are named. Joints that lie alike
    cannot be told apart.
    """
    shown = [servo for servo in servos if servo.id in pulses and servo.goal_range is not None]
    rest = robot.poses.get(REST_POSE, {}) if let_go else {}
    exchanged: list[JointServo] = []
    for one, other in combinations(shown, 2):
        if _look_exchanged(one, other, pulses, rest):
            exchanged += [one, other]
            yield ServoTrouble(
                measured=f"{_where(one, pulses)}, {_where(other, pulses)}: as if their ids were "
                "exchanged",
                remedy=f"move {one.joint} by hand and see which id follows (`vla-deploy servo "
                "monitor`); connect one alone: `vla-deploy servo set-id`",
                level=TroubleLevel.NOTE,
            )
    for servo in shown:
        if servo not in exchanged and _beyond(servo, pulses[servo.id]):
            yield ServoTrouble(
                measured=f"{_where(servo, pulses)}: outside of what the joint can",
                remedy="its id is another joint's, its horn sits elsewhere, or it was never "
                "calibrated: `vla-deploy servo calibrate`",
                level=TroubleLevel.NOTE,
            )


def _look_exchanged(
    one: JointServo, other: JointServo, pulses: Mapping[int, int], rest: Mapping[str, float]
) -> bool:
    """Return whether two joints do not lie at rest, but would with each other's pulses."""
    if one.joint not in rest or other.joint not in rest:
        return False
    mine, others = pulses[one.id], pulses[other.id]
    as_shown = min(_off_rest_rad(one, mine, rest), _off_rest_rad(other, others, rest))
    as_exchanged = max(_off_rest_rad(one, others, rest), _off_rest_rad(other, mine, rest))
    return as_shown >= _OFF_REST_RAD and as_exchanged <= _AT_REST_RAD


def _beyond(servo: JointServo, pulse: int) -> bool:
    low, high = servo.goal_range or (0.0, 0.0)
    leaning = _LEANING * (high - low)
    return not low - leaning <= servo.to_joint(pulse) <= high + leaning


def _off_rest_rad(servo: JointServo, pulse: int, rest: Mapping[str, float]) -> float:
    return abs(servo.to_joint(pulse) - rest[servo.joint]) / servo.travel_per_rad


def _where(servo: JointServo, pulses: Mapping[int, int]) -> str:
    low, high = servo.goal_range or (0.0, 0.0)
    value = servo.to_joint(pulses[servo.id])
    return f"servo {servo.id} ({servo.joint}) stands at {value:.2f}, limits {low:g}..{high:g}"
