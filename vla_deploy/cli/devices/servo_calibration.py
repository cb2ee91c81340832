"""`vla-deploy servo calibration export | import`: exchange the calibration with other software."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

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
HOMING_REGISTER: Final = "homing_offset"
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
        "  vla-deploy servo calibration import my_arm.json --robot so101 --read-servos\n",
        run_import,
    )
    exporting = add_command(
        acts,
        "export",
        "write the calibration as other software reads it",
        "  vla-deploy servo calibration export my_arm.json --robot so101\n",
        run_export,
    )
    for act in (importing, exporting):
        act.add_argument("file", type=Path, help="the other software's file")
        act.add_argument(
            "--format", choices=FORMATS, default=FORMATS[0], help="of the file (default: lerobot)"
        )
        add_bus_arguments(act)
        act.add_argument(
            "--read-servos", action="store_true", help="ask the servos for their homing offsets"
        )
    importing.add_argument(
        "--homing",
        choices=("servo", "none"),
        help="servo: the servos hold the file's homing offsets, as LeRobot leaves them (default); "
        "none: they hold 0 (default of Dynamixels, whose bus refuses any other)",
    )
    importing.add_argument(
        "--output", type=Path, help=f"write here (default: {CALIBRATION_FILE} at the robot file)"
    )


def run_import(arguments: argparse.Namespace) -> int:
    """Read a file, judge it by the robot, and write it over the joints that it names.

    Raises:
        UsageError: no robot is named, or what is asked for contradicts itself.
        RobotFileError: the file does not fit the robot; nothing is written.
        CommandFailed: a servo holds another homing offset than the file.
    """
    if arguments.read_servos and arguments.homing:
        raise UsageError("--homing and --read-servos: give one of them; the servos say which it is")
    bus = bus_of(arguments)
    robot = _robot_of(bus)
    motors = read_lerobot(arguments.file)
    output = arguments.output or robot.mjcf_path.parent / CALIBRATION_FILE
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
    calibrations = read_calibration(robot.mjcf_path.parent / CALIBRATION_FILE)
    held = _held_offsets(bus, robot.joint_names) if arguments.read_servos else {}
    for name, offset in held.items():
        _require_as_calibrated(name, calibrations.get(name), offset)
    motors = exported(robot, calibrations, held)
    write_lerobot(arguments.file, motors)
    report = {"file": str(arguments.file), "motors": {n: asdict(m) for n, m in motors.items()}}
    lines = [
        f"{name}: {motor.range_min}..{motor.range_max}, homing offset {motor.homing_offset}"
        for name, motor in motors.items()
    ]
    return emit(arguments, report, "\n".join([*lines, f"written to {arguments.file}"]))


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
    if not arguments.read_servos:
        usual = "none" if bus.family.name == "dynamixel" else "servo"
        return dict.fromkeys(motors, (arguments.homing or usual) == "servo")
    held = _held_offsets(bus, [name for name in motors if name in robot.joint_index])
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
        return {
            name: next(
                register.value
                for register in link.registers(link.servo(ids[name], name))
                if register.name == HOMING_REGISTER
            )
            for name in names
        }


def _require_as_calibrated(name: str, calibration: JointCalibration | None, offset: int) -> None:
    origin = None if calibration is None else calibration.lerobot
    if origin is None:
        return
    expected = origin.homing_offset if origin.homing_in_servo else 0
    if offset != expected:
        raise CommandFailed(
            f"{name}: its servo holds homing offset {offset}, expected {expected} as calibrated: "
            "something wrote it since; import LeRobot's file again, or calibrate the joint"
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
