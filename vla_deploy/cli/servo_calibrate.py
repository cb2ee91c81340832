"""`vla-deploy servo calibrate`: measure how the servos sit on the joints; nothing is driven."""

import argparse
import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from drivers.dynamixel.control_table import PULSES_PER_REV
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tools import BenchLink
from drivers.dynamixel.tools.bench_link import ONE_TRY
from drivers.dynamixel.tools.travel import ServoMounting, TravelRefused
from drivers.errors import NoReply
from vla_deploy.cli.calibration_guide import (
    CalibrationGuide,
    Console,
    GuidedJoint,
    Person,
    in_words,
)
from vla_deploy.cli.calibration_plan import (
    chosen_joints,
    guided_joints,
    read_pose,
    require_values,
)
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_command
from vla_deploy.cli.servo_wire import (
    ServoWire,
    add_wire_arguments,
    add_yes_argument,
    confirm,
    wire_of,
)
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    read_calibration,
    write_calibration,
)

_TRIES: Final = 3
EXAMPLES = """  vla-deploy servo calibrate --robot butler --joint left_elbow
  vla-deploy servo calibrate --robot butler --method mark --at 0
  vla-deploy servo calibrate --robot butler --from-pose rest --yes
  vla-deploy servo calibrate --robot butler --from-pose head_pan=0,head_tilt=0.3 --yes
"""


def register(commands: Any) -> None:
    """Add the command."""
    calibrate = add_command(
        commands, "calibrate", "measure sign and offset of joints by hand", EXAMPLES
    )
    add_wire_arguments(calibrate)
    add_yes_argument(calibrate)
    calibrate.add_argument("--joint", action="append", help="this joint (repeat it; default: all)")
    calibrate.add_argument(
        "--method",
        choices=("ends", "mark"),
        default="ends",
        help="ends: move each joint from its lower to its upper end; mark: to one mark",
    )
    calibrate.add_argument("--at", type=float, default=0.0, help="the mark's value (default: 0)")
    calibrate.add_argument(
        "--from-pose", help="the joints stand at these values now: a pose, or joint=value,..."
    )
    calibrate.add_argument(
        "--accept-sign", action="store_true", help="take a sign other than the robot file's"
    )
    calibrate.add_argument(
        "--output", type=Path, help=f"write here (default: {CALIBRATION_FILE} at the robot file)"
    )
    calibrate.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, and write each joint as soon as it is measured.

    Raises:
        UsageError: a joint, pose or value is not the robot's.
        CommandFailed: a joint could not be measured; those before it are written.
        DriverError: a servo is silent, or the bus is lost.
    """
    wire = wire_of(arguments)
    if wire.robot is None:
        raise UsageError("--port alone is no robot: add --robot, whose joints are calibrated")
    console = Console(quiet=arguments.json)
    with wire.open() as link:
        return calibrate(arguments, wire, wire.robot, link, console)


def calibrate(
    arguments: argparse.Namespace,
    wire: ServoWire,
    robot: RobotDescription,
    link: BenchLink,
    person: Person,
) -> int:
    """Do the work of `run` on an open bus.

    Raises:
        UsageError: a joint, pose or value is not the robot's.
        CommandFailed: a joint could not be measured; those before it are written.
        DriverError: a servo is silent, or the bus is lost.
    """
    pose = read_pose(robot, arguments.from_pose) if arguments.from_pose else {}
    names = chosen_joints(robot, arguments.joint or list(pose))
    require_values(robot, names, pose, arguments)
    watched = _answering(robot, link, names)
    _release(arguments, link, watched)
    results = _Results(arguments.output or robot.mjcf_path.parent / CALIBRATION_FILE, person)
    guide = CalibrationGuide(
        link.registers, watched, person, wire.clock, accept_sign=arguments.accept_sign
    )
    joints = guided_joints(robot, names)
    if pose:
        stands = guide.as_it_stands({joint: pose[joint.name] for joint in joints})
        results.keep(joints, stands, "pose")
        failures = []
    else:
        failures = _one_by_one(arguments, guide, joints, results, person)
    _tell_counted_turns(link, joints, person)
    if arguments.json:
        print(json.dumps(results.document(failures), indent=2))
    if failures:
        raise CommandFailed(f"not calibrated: {', '.join(failures)}; see above, then try again")
    return 0


def _one_by_one(
    arguments: argparse.Namespace,
    guide: CalibrationGuide,
    joints: Sequence[GuidedJoint],
    results: "_Results",
    person: Person,
) -> list[str]:
    """Return the joints that could not be measured."""
    failures = []
    for joint in joints:
        for _ in range(_TRIES):
            try:
                by_ends = arguments.method == "ends"
                found = guide.by_ends(joint) if by_ends else guide.by_mark(joint, arguments.at)
            except TravelRefused as refusal:
                person.tell(f"refused: {refusal}")
                continue
            results.keep([joint], {joint.name: found}, arguments.method)
            break
        else:
            failures.append(joint.name)
    return failures


class _Results:
    """Write each result at once, over those of earlier sessions."""

    def __init__(self, file: Path, person: Person) -> None:
        self._file = file
        self._person = person
        self._all = read_calibration(file)
        self._changes: list[dict[str, Any]] = []

    def keep(
        self, joints: Sequence[GuidedJoint], found: Mapping[str, ServoMounting], method: str
    ) -> None:
        """Write what was found of some joints, and tell what it changes."""
        made_at = datetime.now(UTC).isoformat(timespec="seconds")
        for joint in joints:
            mounting = found[joint.name]
            self._all[joint.name] = JointCalibration(
                servo_id=joint.servo.id,
                sign=mounting.sign,
                offset=round(mounting.offset, 6),
                method=method,
                made_at=made_at,
            )
            self._changes.append(_change(joint, mounting))
        write_calibration(self._file, self._all)
        for joint in joints:
            self._person.tell(in_words(joint, found[joint.name]))
        self._person.tell(f"written to {self._file}")

    def document(self, failures: Sequence[str]) -> dict[str, Any]:
        """Return all of this session as a JSON document."""
        return {"file": str(self._file), "joints": self._changes, "failed": list(failures)}


def _change(joint: GuidedJoint, after: ServoMounting) -> dict[str, Any]:
    return {
        "joint": joint.name,
        "servo_id": joint.servo.id,
        "sign_before": joint.present.sign,
        "sign": after.sign,
        "offset_before": joint.present.offset,
        "offset": round(after.offset, 6),
    }


def _tell_counted_turns(link: BenchLink, joints: Sequence[GuidedJoint], person: Person) -> None:
    """Name the servos that were turned by hand out of the range in which they take goals."""
    for joint in joints:
        position = link.read(joint.servo, "present_position")
        if not 0 <= position < PULSES_PER_REV:
            person.tell(
                f"{joint.servo} counts {position} pulses, beyond one turn; restart it before the "
                f"robot runs: vla-deploy servo reboot {joint.servo.id}"
            )


def _answering(robot: RobotDescription, link: BenchLink, names: Sequence[str]) -> list[ServoSpec]:
    """Return the servos to watch: the chosen ones must answer, the others may be away.

    Raises:
        ServoSilent: a chosen servo does not answer.
    """
    watched = []
    for servo in robot.servo_bus.servos:
        try:
            if servo.joint not in names:
                link.ping(servo.id, ONE_TRY)
            watched.append(link.servo(servo.id, servo.joint))
        except NoReply:
            if servo.joint in names:
                raise
    return watched


def _release(arguments: argparse.Namespace, link: BenchLink, servos: Sequence[ServoSpec]) -> None:
    powered = [servo for servo in servos if link.read(servo, "torque_enable")]
    if not powered:
        return
    joints = ", ".join(servo.joint for servo in powered)
    confirm(arguments, f"The torque of {joints} goes off: hold what would fall.")
    for servo in powered:
        link.write(servo, "torque_enable", 0)
