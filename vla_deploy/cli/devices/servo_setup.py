"""`vla-deploy servo setup`: give new servos the ids and the speed that the robot file says."""

import argparse
from collections.abc import Collection, Sequence
from typing import Any, Final

from drivers.errors import DriverError
from drivers.servo.tools.bench import FoundServo, ServoBench
from drivers.servo.tools.calibration_guide import Person
from drivers.servo.tools.scan import is_model, scan_speed
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
from vla_deploy.cli.devices.servo_change import require_speed
from vla_deploy.cli.devices.servo_scan import speeds_to_ask
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.devices import Servo, shadow_name

_TRIES: Final = 3
_EXAMPLES: Final = """  vla-deploy servo setup --robot so101
  vla-deploy servo setup --robot so101 --port /dev/ttyACM0 --joint gripper
"""


def register(commands: Any) -> None:
    """Add the command."""
    summary = "give new servos their ids and speed, one connected at a time"
    setup = add_command(commands, "setup", summary, _EXAMPLES, run)
    add_bus_arguments(setup)
    add_yes_argument(setup)
    setup.add_argument("--joint", action="append", help="this joint (repeat it; default: all)")


def run(arguments: argparse.Namespace) -> int:
    """Set up servos, guided.

    Raises:
        UsageError: no robot is named, or a joint is not the robot's.
        CommandFailed: a servo could not be set up; those before it are.
    """
    bus = bus_of(arguments)
    if bus.robot is None:
        raise UsageError("--port alone is no robot: add --robot, whose servos are set up")
    return set_up(arguments, bus, bus.robot, Console(quiet=arguments.json))


def set_up(
    arguments: argparse.Namespace, bus: ServoBusPort, robot: RobotDescription, person: Person
) -> int:
    """Do the work of `run`.

    Raises:
        UsageError: a joint is not the robot's, or its servo cannot have the bus' speed.
        CommandFailed: a servo could not be set up; those before it are.
    """
    rows: list[dict[str, Any]] = []
    failures = []
    for declared in _chosen(robot, arguments.joint or ()):
        for _ in range(_TRIES):
            person.wait(
                f"{declared.joint}: connect its servo, {declared.model}, alone to {bus.port}",
                lambda: None,
            )
            try:
                row = _set_up_one(arguments, bus, declared, {one["id"] for one in rows})
            except (CommandFailed, DriverError) as refusal:
                person.tell(f"refused: {refusal}")
                continue
            rows.append(row)
            person.tell(_words(row))
            break
        else:
            failures.append(declared.joint)
    emit(arguments, {"servos": rows, "failed": failures}, "")
    if failures:
        raise CommandFailed(f"not set up: {', '.join(failures)}; see above, then try again")
    person.tell(f"connect them all, then: vla-deploy servo scan --robot {robot.name}")
    return 0


def _chosen(robot: RobotDescription, joints: Sequence[str]) -> Sequence[Servo]:
    """Return the servos to set up, the highest id first: a new servo has a low one.

    Raises:
        UsageError: the robot has no such joint or wheel.
    """
    turning = [one.joint for one in robot.servo_bus.wheels]
    names = [one for one in turning if one in joints or not joints]
    if len(names) < len(joints) or not joints:
        names += chosen_joints(robot, [one for one in joints if one not in turning])
    names += [shadow_name(one.joint) for one in robot.servo_bus.shadows if one.joint in names]
    chosen = [one for one in robot.servo_bus.all_servos if one.joint in names]
    return sorted(chosen, key=lambda one: one.id, reverse=True)


def _set_up_one(
    arguments: argparse.Namespace, bus: ServoBusPort, declared: Servo, done: Collection[int]
) -> dict[str, Any]:
    found, baud = _only_servo(bus)
    if not is_model(found.model_name, declared.model):
        raise CommandFailed(
            f"servo {found.servo_id} is {found.model_name}, the robot file says {declared.model}; "
            "connect the right one"
        )
    if found.servo_id in done:
        raise CommandFailed(
            f"{bus.label(found.servo_id)} was set up before; connect the one of {declared.joint}"
        )
    with bus.open(baud) as link:
        servo = link.servo(found.servo_id, declared.joint)
        require_speed(link, servo, bus.baud)
        if link.torque_is_on(servo):
            confirm(arguments, f"The torque of {servo} goes off: what it carries falls.")
            link.release(servo)
        if found.servo_id != declared.id:
            link.set_id(servo, declared.id)
            servo = link.servo(declared.id, declared.joint)
        old_baud = link.present_baud(servo)
        if old_baud != bus.baud:
            link.set_baud(servo, bus.baud)
    with bus.open() as link:
        _require_set(link, bus, declared)
    return {
        "joint": declared.joint,
        "id": declared.id,
        "old_id": found.servo_id,
        "baud": bus.baud,
        "old_baud": old_baud,
        "model": found.model_name,
        "firmware": found.firmware,
    }


def _only_servo(bus: ServoBusPort) -> tuple[FoundServo, int]:
    """Return the one servo that is connected, and the speed at which it answers.

    Raises:
        CommandFailed: none answers, or more than one.
    """
    for baud in speeds_to_ask(bus):
        with bus.open(baud) as link:
            report = scan_speed(link)
        if report.clashes:
            raise CommandFailed("several servos answer to one id; connect one alone")
        if len(report.servos) > 1:
            ids = ", ".join(str(one.servo_id) for one in report.servos)
            raise CommandFailed(f"{len(report.servos)} servos answer, ids {ids}; connect one alone")
        if report.servos:
            return report.servos[0], baud
    raise CommandFailed(
        f"{bus.port}: no servo answers at any speed; check its power and cable, and --family"
    )


def _require_set(link: ServoBench, bus: ServoBusPort, declared: Servo) -> None:
    servo = link.servo(declared.id, declared.joint)
    got = link.present_baud(servo)
    if got != bus.baud:
        raise CommandFailed(f"{servo}: says {got} baud, expected {bus.baud}")


def _words(row: dict[str, Any]) -> str:
    was = "as before" if row["id"] == row["old_id"] else f"was {row['old_id']}"
    speed = "as before" if row["baud"] == row["old_baud"] else f"was {row['old_baud']}"
    return (
        f"{row['joint']}: id {row['id']} ({was}), {row['baud']} baud ({speed}); write it on the "
        "servo"
    )
