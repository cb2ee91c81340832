"""`vla-deploy servo calibrate`: measure the mounting of servos on joints.

A person moves the joints; only `--method stops` drives them, one at a time and gently.
"""

import argparse
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench
from drivers.servo.tools.calibration_guide import CalibrationGuide, GuidedJoint, Person
from drivers.servo.tools.stop_search import StopSearch
from drivers.servo.tools.travel import PULSE_RAD, PULSES_PER_REV, ServoMounting, TravelRefused
from vla_deploy.cli.commands import add_command, emit
from vla_deploy.cli.devices.console import Console
from vla_deploy.cli.devices.servo_bus import (
    ServoBusPort,
    add_bus_arguments,
    add_yes_argument,
    bus_of,
    chosen_joints,
    confirm,
)
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.calibration.calibration import CALIBRATION_FILE
from vla_deploy.robots.joint_calibration import (
    CalibrationRecord,
    answering_servos,
    guided_joints,
    shadows_of,
)

_TRIES: Final = 3
_ENDING_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
EXAMPLES = """  vla-deploy servo calibrate --robot butler --joint left_elbow
  vla-deploy servo calibrate --robot butler --method mark --at 0
  vla-deploy servo calibrate --robot so101 --method stops
  vla-deploy servo calibrate --robot butler --from-pose rest --yes
  vla-deploy servo calibrate --robot butler --from-pose head_pan=0,head_tilt=0.3 --yes
"""


def register(commands: Any) -> None:
    """Add the command."""
    calibrate = add_command(
        commands, "calibrate", "measure sign and offset of joints", EXAMPLES, run
    )
    add_bus_arguments(calibrate)
    add_yes_argument(calibrate)
    calibrate.add_argument("--joint", action="append", help="this joint (repeat it; default: all)")
    calibrate.add_argument(
        "--method",
        choices=("ends", "mark", "stops"),
        default="ends",
        help="ends: move each joint from its lower to its upper end; mark: to one mark; stops: it "
        "drives those joints against their stops for which the robot file allows it",
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


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, and write each joint as soon as it is measured.

    Raises:
        UsageError: a joint, pose or value is not the robot's.
        CommandFailed: a joint could not be measured; those before it are written.
        DriverError: a servo is silent, or the bus is lost.
    """
    bus = bus_of(arguments)
    if bus.robot is None:
        raise UsageError("--port alone is no robot: add --robot, whose joints are calibrated")
    console = Console(quiet=arguments.json)
    with bus.open() as link:
        return calibrate(arguments, bus, bus.robot, link, console)


def calibrate(
    arguments: argparse.Namespace,
    bus: ServoBusPort,
    robot: RobotDescription,
    link: ServoBench,
    person: Person,
) -> int:
    """Do the work of `run` on an open bus.

    Raises:
        UsageError: a joint, pose or value is not the robot's.
        CommandFailed: a joint could not be measured; those before it are written.
        DriverError: a servo is silent, or the bus is lost.
    """
    pose = _read_pose(robot, arguments.from_pose) if arguments.from_pose else {}
    by_stops = arguments.method == "stops"
    names = _allowed(robot, arguments) if by_stops else arguments.joint or list(pose)
    names = chosen_joints(robot, names)
    joints = guided_joints(robot, names)
    _require_turns(joints)
    _require_values(joints, pose, arguments)
    watched = answering_servos(robot, link, names)
    record = CalibrationRecord(arguments.output or robot.folder / CALIBRATION_FILE)
    failures = []
    if by_stops:
        _announce_drive(arguments, robot, names)
        search = StopSearch(link, watched, person, bus.clock)
        with _signals_interrupt():
            failures = _calibrate_one_by_one(
                lambda joint: search.mounting_of(joint, robot.against_stops[joint.name]),
                *(joints, record, person),
                method="stops",
                tries=1,
            )
        return _report(arguments, link, joints, record, failures, person)
    _release(arguments, link, [*watched, *shadows_of(robot, link, names)])
    guide = CalibrationGuide(link, watched, person, bus.clock, accept_sign=arguments.accept_sign)
    if pose:
        stands = guide.as_it_stands({joint: pose[joint.name] for joint in joints})
        _store(record, joints, stands, "pose", person)
    else:
        by_ends = arguments.method == "ends"
        failures = _calibrate_one_by_one(
            guide.by_ends if by_ends else lambda joint: guide.by_mark(joint, arguments.at),
            *(joints, record, person),
            method=arguments.method,
        )
    return _report(arguments, link, joints, record, failures, person)


def _allowed(robot: RobotDescription, arguments: argparse.Namespace) -> list[str]:
    """Return the joints that are to be driven against their stops.

    Raises:
        UsageError: the robot file does not allow it, or another option does not go with it.
    """
    allowed = robot.against_stops
    if arguments.from_pose:
        raise UsageError("--from-pose drives nothing: leave out --method stops")
    if unknown := [one for one in arguments.joint or () if one not in allowed]:
        raise UsageError(
            f"{robot.name}: {', '.join(unknown)} may not be driven against its stops; its file "
            f"allows it for {', '.join(allowed) or 'no joint'}: [calibration.against_stops]"
        )
    if not allowed:
        raise UsageError(
            f"{robot.name}: no joint may be driven against its stops: [calibration.against_stops] "
            "is not in its file; calibrate it by hand"
        )
    return arguments.joint or list(allowed)


def _announce_drive(
    arguments: argparse.Namespace, robot: RobotDescription, names: Sequence[str]
) -> None:
    shares = ", ".join(f"{one} at {robot.against_stops[one].torque_ratio:.0%}" for one in names)
    confirm(
        arguments,
        f"These joints move from stop to stop, one after the other, with a part of their torque: "
        f"{shares}. Clear their way, and keep the supply's switch at hand.",
    )


def _report(
    arguments: argparse.Namespace,
    link: ServoBench,
    joints: Sequence[GuidedJoint],
    record: CalibrationRecord,
    failures: Sequence[str],
    person: Person,
) -> int:
    """Say how it ended.

    Raises:
        CommandFailed: a joint could not be measured.
    """
    _warn_of_turns(link, joints, person)
    report = {"file": str(record.file), "joints": record.changes, "failed": [*failures]}
    emit(arguments, report, "")
    if failures:
        raise CommandFailed(f"not calibrated: {', '.join(failures)}; see above, then try again")
    return 0


def _calibrate_one_by_one(
    measure: Callable[[GuidedJoint], ServoMounting],
    joints: Sequence[GuidedJoint],
    record: CalibrationRecord,
    person: Person,
    *,
    method: str,
    tries: int = _TRIES,
) -> list[str]:
    """Return the joints that could not be measured."""
    failures = []
    for joint in joints:
        for _ in range(tries):
            try:
                found = measure(joint)
            except TravelRefused as refusal:
                person.tell(f"refused: {refusal}")
                continue
            _store(record, [joint], {joint.name: found}, method, person)
            break
        else:
            failures.append(joint.name)
    return failures


def _store(
    record: CalibrationRecord,
    joints: Sequence[GuidedJoint],
    found: Mapping[str, ServoMounting],
    method: str,
    person: Person,
) -> None:
    record.store(joints, found, method)
    for joint in joints:
        person.tell(_words(joint, found[joint.name]))
    person.tell(f"written to {record.file}")


def _warn_of_turns(link: ServoBench, joints: Sequence[GuidedJoint], person: Person) -> None:
    """Warn of servos that were turned by hand beyond the range in which they take goals."""
    for joint in joints:
        position = link.positions([joint.servo]).get(joint.servo.id, 0)
        if not 0 <= position < PULSES_PER_REV:
            person.tell(
                f"{joint.servo} counts {position} pulses, beyond one turn; restart it before the "
                f"robot runs: vla-deploy servo reboot {joint.servo.id}"
            )


def _release(arguments: argparse.Namespace, link: ServoBench, servos: Sequence[JointServo]) -> None:
    powered = [servo for servo in servos if link.torque_is_on(servo)]
    if not powered:
        return
    joints = ", ".join(servo.joint for servo in powered)
    confirm(arguments, f"The torque of {joints} goes off: hold what would fall.")
    for servo in powered:
        link.release(servo)


@contextmanager
def _signals_interrupt() -> Iterator[None]:
    """Let the signals that end a program act like Ctrl-C, so that a driven servo is let go.

    Only the first one counts: letting go is not interrupted. Outside of the main thread nothing is
    changed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupted: list[int] = []

    def interrupt(number: int, _frame: object) -> None:
        interrupted.append(number)
        if len(interrupted) == 1:
            raise KeyboardInterrupt

    before = {one: signal.signal(one, interrupt) for one in _ENDING_SIGNALS}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def _read_pose(robot: RobotDescription, text: str) -> dict[str, float]:
    """Return the joints' values of a pose of the robot, or of `joint=value,...`.

    Raises:
        UsageError: it is neither.
    """
    if text in robot.poses:
        return dict(robot.poses[text])
    values = {}
    for part in text.split(","):
        joint, equals, value = part.partition("=")
        try:
            values[joint.strip()] = float(value)
        except ValueError:
            known = ", ".join(robot.poses)
            expected = f"expected joint=value,... or a pose of the robot: {known}"
            raise UsageError(f"--from-pose {text}: {expected}") from None
        if not equals:
            raise UsageError(f"--from-pose {text}: expected joint=value, got {part!r}")
    return values


def _require_turns(joints: Sequence[GuidedJoint]) -> None:
    """Check that the servos measure a whole turn in the pulses that the guide counts in.

    Raises:
        UsageError: one does not.
    """
    for joint in joints:
        if joint.servo.pulse_rad != PULSE_RAD:
            raise UsageError(
                f"{joint.servo} does not measure a whole turn in {PULSES_PER_REV} pulses, and only "
                "such servos can be calibrated here; write sign and offset into the robot file"
            )


def _require_values(
    joints: Sequence[GuidedJoint], pose: Mapping[str, float], arguments: argparse.Namespace
) -> None:
    """Check that every joint can have the value that it is said to have.

    Raises:
        UsageError: a value is missing or outside of the joint's range.
    """
    if not pose and arguments.method != "mark":
        return
    missing = [joint.name for joint in joints if pose and joint.name not in pose]
    if missing:
        raise UsageError(f"--from-pose gives no value for {', '.join(missing)}")
    for joint in joints:
        value, low, high = pose.get(joint.name, arguments.at), joint.range.low, joint.range.high
        if not low <= value <= high:
            raise UsageError(f"{joint.name}: {value:g} is outside of its range {low:g}..{high:g}")


def _words(joint: GuidedJoint, after: ServoMounting) -> str:
    """Return what a calibration changes."""
    before = joint.present
    change = after.offset - before.offset
    sign = f"sign {before.sign:+d}"
    if after.sign != before.sign:
        sign += f" -> {after.sign:+d}"
    return f"{joint.name}: {sign}, offset {before.offset:.4f} -> {after.offset:.4f} ({change:+.4f})"
