"""`vla-deploy servo calibration import | export | check`: exchange it with other software."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from drivers.errors import DeviceMissing
from vla_deploy.cli.commands import add_command, emit
from vla_deploy.cli.devices.servo_bus import ServoBusPort, add_bus_arguments, bus_of
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    read_calibration,
    write_calibration,
)
from vla_deploy.robots.calibration.lerobot_conversion import exported, imported
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor, read_lerobot, write_lerobot

FORMATS: Final = ("lerobot",)
_LEROBOT_FOLDER: Final = "~/.cache/huggingface/lerobot/calibration/robots"
_EXAMPLES: Final = f"""\
  vla-deploy servo calibration import {_LEROBOT_FOLDER}/so_follower/my_arm.json --robot so101
  vla-deploy servo calibration export {_LEROBOT_FOLDER}/so_follower/my_arm.json --robot so101
"""


def register(commands: Any) -> None:
    """Add the commands."""
    summary = "exchange the calibration with other software"
    acts = add_command(commands, "calibration", summary, _EXAMPLES).add_subparsers(
        dest="calibration_command", required=True, metavar="ACT"
    )
    importing = add_command(
        acts,
        "import",
        f"take the calibration of other software over into {CALIBRATION_FILE}",
        "  vla-deploy servo calibration import my_arm.json --robot so101\n"
        "  vla-deploy servo calibration import my_arm.json --robot so101 --homing servo\n",
        run_import,
    )
    exporting = add_command(
        acts,
        "export",
        "write the calibration as other software reads it",
        "  vla-deploy servo calibration export my_arm.json --robot so101\n",
        run_export,
    )
    checking = add_command(
        acts,
        "check",
        "compare the homing offsets that the servos hold with those of the calibration",
        "  vla-deploy servo calibration check --robot so101\n",
        run_check,
    )
    for act in (importing, exporting):
        act.add_argument("file", type=Path, help="the other software's file")
        act.add_argument(
            "--format", choices=FORMATS, default=FORMATS[0], help="of the file (default: lerobot)"
        )
    for act in (importing, exporting, checking):
        add_bus_arguments(act)
    exporting.add_argument(
        "--read-servos", action="store_true", help="ask the servos for their homing offsets"
    )
    importing.add_argument(
        "--homing",
        choices=("servo", "none"),
        help="without asking the servos: they hold the file's homing offsets, as LeRobot leaves "
        "them, or 0 (default: they are asked)",
    )
    importing.add_argument(
        "--output", type=Path, help=f"write here (default: {CALIBRATION_FILE} at the robot file)"
    )


def run_import(arguments: argparse.Namespace) -> int:
    """Read a file, judge it by the robot, and write it over the joints that it names.

    Raises:
        UsageError: no robot is named, or its servos are not there and `--homing` is not given.
        RobotFileError: the file does not fit the robot; nothing is written.
        CommandFailed: a servo holds another homing offset than the file.
    """
    bus = bus_of(arguments)
    robot = _robot_of(bus)
    motors = read_lerobot(arguments.file)
    output = arguments.output or robot.folder / CALIBRATION_FILE
    present = read_calibration(output)
    in_servo = _homing_in_servo(arguments, bus, robot, motors)
    found = imported(robot, motors, present, in_servo, arguments.file)
    changed = {name: one for name, one in found.items() if one != present.get(name)}
    if changed:
        write_calibration(output, {**present, **changed})
    report = {
        "file": str(output),
        "joints": {name: asdict(one) for name, one in changed.items()},
        "unchanged": [name for name in motors if name not in changed],
        "not_in_file": [name for name in robot.joint_names if name not in motors],
    }
    return emit(arguments, report, "\n".join(_words(robot, changed, report)))


def run_export(arguments: argparse.Namespace) -> int:
    """Write the calibration of every joint.

    Raises:
        UsageError: no robot is named.
        CommandFailed: a servo holds another homing offset than the calibration says.
    """
    bus = bus_of(arguments)
    robot = _robot_of(bus)
    calibrations = read_calibration(robot.folder / CALIBRATION_FILE)
    held = _held_offsets(bus, robot.joint_names) if arguments.read_servos else {}
    _require_as_calibrated(calibrations, held)
    motors = exported(robot, calibrations, held)
    write_lerobot(arguments.file, motors)
    report = {"file": str(arguments.file), "motors": {n: asdict(m) for n, m in motors.items()}}
    lines = [
        f"{name}: {motor.range_min}..{motor.range_max}, homing offset {motor.homing_offset}"
        for name, motor in motors.items()
    ]
    return emit(arguments, report, "\n".join([*lines, f"written to {arguments.file}"]))


def run_check(arguments: argparse.Namespace) -> int:
    """Read the homing offset of every servo and compare it.

    Raises:
        UsageError: no robot is named.
        CommandFailed: servos hold others than when they were calibrated.
    """
    bus = bus_of(arguments)
    robot = _robot_of(bus)
    calibrations = read_calibration(robot.folder / CALIBRATION_FILE)
    held = _held_offsets(bus, robot.joint_names)
    _require_as_calibrated(calibrations, held)
    lines = [
        f"{name}: homing offset {offset}, "
        + ("as calibrated" if _expected_offset(calibrations.get(name)) == offset else "part of it")
        for name, offset in held.items()
    ]
    return emit(arguments, held, "\n".join(lines))


def _robot_of(bus: ServoBusPort) -> RobotDescription:
    if bus.robot is None:
        raise UsageError("--port alone is no robot: add --robot, whose calibration it is")
    return bus.robot


def _homing_in_servo(
    arguments: argparse.Namespace,
    bus: ServoBusPort,
    robot: RobotDescription,
    motors: Mapping[str, LeRobotMotor],
) -> dict[str, bool]:
    """Return for each motor whether its servo holds the homing offset of the file."""
    if arguments.homing:
        return dict.fromkeys(motors, arguments.homing == "servo")
    try:
        held = _held_offsets(bus, [name for name in motors if name in robot.joint_index])
    except DeviceMissing as error:
        raise UsageError(
            f"{error}; or say what the servos hold, without asking them, with --homing"
        ) from error
    for name, offset in held.items():
        if offset not in (0, motors[name].homing_offset):
            raise CommandFailed(
                f"{name}: its servo holds homing offset {offset}, expected "
                f"{motors[name].homing_offset} of the file, or 0: it was calibrated after this file"
            )
    return {name: held.get(name) == motor.homing_offset for name, motor in motors.items()}


def _held_offsets(bus: ServoBusPort, names: Sequence[str]) -> dict[str, int]:
    """Return the homing offset that the servo of each joint holds."""
    ids = {joint: servo_id for servo_id, joint in bus.joints.items()}
    with bus.open() as link:
        held = link.homing_offsets([link.servo(ids[name], name) for name in names])
    return {name: held[ids[name]] for name in names}


def _expected_offset(calibration: JointCalibration | None) -> int | None:
    """Return the homing offset with which a joint was calibrated; None where it is not known."""
    return None if calibration is None else calibration.expected_homing_offset


def _require_as_calibrated(
    calibrations: Mapping[str, JointCalibration], held: Mapping[str, int]
) -> None:
    expected = {name: _expected_offset(calibrations.get(name)) for name in held}
    wrong = [
        f"{name}: its servo holds homing offset {offset}, expected {expected[name]} as calibrated"
        for name, offset in held.items()
        if expected[name] not in (None, offset)
    ]
    if wrong:
        raise CommandFailed(
            "; ".join(wrong)
            + ": something wrote it since; import LeRobot's file again, or calibrate the joint"
        )


def _words(
    robot: RobotDescription, changed: Mapping[str, JointCalibration], report: Mapping[str, Any]
) -> list[str]:
    before = {servo.joint: servo.offset for servo in robot.servo_bus.servos}
    lines = [f"{n}: offset {before[n]:.4f} -> {one.offset:.4f}" for n, one in changed.items()]
    if report["unchanged"]:
        lines.append(f"as it was: {', '.join(report['unchanged'])}")
    if report["not_in_file"]:
        lines.append(f"not in the file, as they were: {', '.join(report['not_in_file'])}")
    return [*lines, f"written to {report['file']}" if changed else "nothing to write"]
