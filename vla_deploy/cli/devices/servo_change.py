"""`vla-deploy servo set-id | set-baud | set-limits | reboot | factory-reset`: change a servo."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, Final

from drivers.errors import DriverError, NoReply, ProtocolError
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import Keep, RegisterValue, ServoBench
from drivers.servo.tools.scan import is_taken
from vla_deploy.cli.commands import Run, add_command, emit
from vla_deploy.cli.devices.servo_bus import (
    SPEEDS,
    ServoBusPort,
    add_bus_arguments,
    add_yes_argument,
    bus_of,
    confirm,
    servo_id,
)
from vla_deploy.cli.errors import CommandFailed, UsageError

_LIMITS: Final = ("min_position_limit", "max_position_limit")


def register(commands: Any) -> None:
    """Add the commands."""
    set_id = _add(commands, "set-id", "give a servo another id", "set-id 1 7", run_set_id)
    set_id.add_argument("id", type=servo_id, help="the id it has")
    set_id.add_argument("new_id", type=servo_id, help="the id it is to have")
    set_baud = _add(
        commands,
        "set-baud",
        "give servos another speed; all servos of a bus need the same",
        "set-baud 3000000 1 2 3",
        run_set_baud,
    )
    set_baud.add_argument("new_baud", type=int, choices=SPEEDS, metavar="NEW_BAUD")
    set_baud.add_argument("ids", type=servo_id, nargs="+", metavar="ID")
    set_limits = _add(
        commands,
        "set-limits",
        "let a servo take goals over its whole turn, or between others; nothing moves",
        "set-limits 3",
        run_set_limits,
    )
    set_limits.add_argument("id", type=servo_id)
    set_limits.add_argument(
        "--pulses",
        type=int,
        nargs=2,
        metavar=("LEAST", "MOST"),
        help="these, in pulses (default: the whole turn, for the robot file bounds the goals)",
    )
    reboot = _add(commands, "reboot", "restart a servo; it forgets its RAM", "reboot 3", run_reboot)
    reboot.add_argument("id", type=servo_id)
    reset = _add(
        commands,
        "factory-reset",
        "give a servo its factory settings; it keeps its id",
        "factory-reset 3 --keep id-and-baud",
        run_factory_reset,
    )
    reset.add_argument("id", type=servo_id)
    kept = [one.value for one in Keep]
    reset.add_argument("--keep", choices=kept, default="id", help="what stays (default: id)")


def _add(commands: Any, name: str, summary: str, example: str, run: Run) -> argparse.ArgumentParser:
    examples = f"  vla-deploy servo {example} --port /dev/ttyUSB0\n"
    command = add_command(commands, name, summary, examples, run)
    add_bus_arguments(command)
    add_yes_argument(command)
    return command


def run_set_id(arguments: argparse.Namespace) -> int:
    """Change an id, and read it back.

    Raises:
        UsageError: the new id is taken, or the old one belongs to two servos.
        CommandFailed: the servo does not answer to its new id.
        DriverError: the servo is silent or refuses.
    """
    bus, old, new = bus_of(arguments), arguments.id, arguments.new_id
    with bus.open() as link:
        servo = link.servo(old, bus.joint(old))
        _require_alone(link, bus, old)
        if new == old or is_taken(link, new):
            raise UsageError(f"{bus.port}: id {new} is taken; see: vla-deploy servo scan")
        torque = _torque_question(link, [servo])
        confirm(arguments, f"{servo} gets the id {new}.{torque}")
        link.release(servo)
        link.set_id(servo, new)
        link.servo(new, bus.joint(new))
        if is_taken(link, old):
            raise CommandFailed(f"{servo}: did not take the id {new}; see: vla-deploy servo scan")
    document = {"id": new, "old_id": old}
    return emit(arguments, document, f"{servo} has the id {new} now", indent=None)


def _require_alone(link: ServoBench, bus: ServoBusPort, one: int) -> None:
    if link.is_clash(one):
        raise UsageError(
            f"{bus.port}: more than one servo has the id {one}, both would change; connect one of "
            "them alone"
        )


def _torque_question(link: ServoBench, servos: Sequence[JointServo]) -> str:
    powered = [servo for servo in servos if link.torque_is_on(servo)]
    if not powered:
        return ""
    names = ", ".join(map(str, powered))
    return f" The torque of {names} goes off: what it carries falls."


def run_set_baud(arguments: argparse.Namespace) -> int:
    """Change the speed of servos, and read it back at the new one.

    Raises:
        CommandFailed: a servo does not answer at the new speed; the message says how to recover.
        DriverError: a servo is silent or refuses.
    """
    bus, new = bus_of(arguments), arguments.new_baud
    with bus.open() as link:
        servos = [link.servo(one, bus.joint(one)) for one in arguments.ids]
        for servo in servos:
            require_speed(link, servo, new)
            _require_alone(link, bus, servo.id)
        names = ", ".join(map(str, servos))
        torque = _torque_question(link, servos)
        confirm(arguments, f"{names}: {bus.baud} baud becomes {new} baud.{torque}")
        for servo in servos:
            link.release(servo)
            link.set_baud(servo, new)
    with bus.open(new) as link:
        complaints = [_complaint(link, bus, servo, new) for servo in servos]
    if any(complaints):
        raise CommandFailed("; ".join(filter(None, complaints)))
    document = {"ids": [servo.id for servo in servos], "baud": new, "old_baud": bus.baud}
    return emit(arguments, document, f"{names}: {new} baud", indent=None)


def require_speed(link: ServoBench, servo: JointServo, baud: int) -> None:
    """Check that a servo can be set to a speed.

    Raises:
        UsageError: it cannot.
    """
    bauds = link.bauds(servo)
    if baud not in bauds:
        raise UsageError(f"{servo}: speeds are {', '.join(map(str, sorted(bauds)))}, got {baud}")


def _complaint(link: ServoBench, bus: ServoBusPort, servo: JointServo, baud: int) -> str:
    """Return what is wrong with a servo's new speed, "" for nothing."""
    try:
        got = link.present_baud(servo)
    except (NoReply, ProtocolError):
        return (
            f"{servo} took {baud} baud, but does not answer at it; the adapter may be too slow. "
            f"Find it: vla-deploy servo scan --port {bus.port}; go back: vla-deploy servo "
            f"set-baud {bus.baud} {servo.id} --port {bus.port} --baud {baud}"
        )
    return "" if got == baud else f"{servo}: says {got} baud, expected {baud}"


def run_set_limits(arguments: argparse.Namespace) -> int:
    """Write the position limits of a servo, and read them back.

    Raises:
        UsageError: the limits are none of this servo's, or its id belongs to two.
        CommandFailed: the servo keeps others.
        DriverError: the servo is silent or refuses.
    """
    bus, one = bus_of(arguments), arguments.id
    with bus.open() as link:
        servo = link.servo(one, bus.joint(one))
        _require_alone(link, bus, one)
        before = _limits(link, servo)
        turn = 0, before["max_position_limit"].initial or 0
        least, most = arguments.pulses or turn
        if not turn[0] <= least < most <= turn[1]:
            raise UsageError(
                f"{servo}: expected limits within {turn[0]}..{turn[1]}, the lower one first, got "
                f"{least}..{most}"
            )
        torque = _torque_question(link, [servo])
        old = _range_of(before)
        confirm(arguments, f"{servo}: position limits {old} become {least}..{most}.{torque}")
        link.release(servo)
        link.set_limits(servo, least, most)
        kept = _range_of(_limits(link, servo))
    if kept != f"{least}..{most}":
        raise CommandFailed(f"{servo}: expected position limits {least}..{most}, got {kept}")
    document = {"id": one, "limits": [least, most], "old_limits": old}
    return emit(arguments, document, f"{servo}: position limits {kept} (were {old})", indent=None)


def _limits(link: ServoBench, servo: JointServo) -> dict[str, RegisterValue]:
    return {one.name: one for one in link.registers(servo) if one.name in _LIMITS}


def _range_of(limits: Mapping[str, RegisterValue]) -> str:
    return "..".join(str(limits[name].value) for name in _LIMITS)


def run_reboot(arguments: argparse.Namespace) -> int:
    """Restart a servo and wait until it is back.

    Raises:
        DriverError: the servo is silent or does not come back.
    """
    bus = bus_of(arguments)
    with bus.open() as link:
        servo = link.servo(arguments.id, bus.joint(arguments.id))
        torque = _torque_question(link, [servo])
        if torque:
            confirm(arguments, f"{servo} restarts.{torque}")
        before = link.hardware_error(servo)
        link.reboot(servo)
        after = link.hardware_error(servo)
    document = {"id": servo.id, "hardware_error_before": before, "hardware_error": after}
    text = f"{servo} is back, torque off; hardware error {before} before, {after} now"
    return emit(arguments, document, text, indent=None)


def run_factory_reset(arguments: argparse.Namespace) -> int:
    """Reset a servo and find it again.

    Raises:
        UsageError: it would get an id that is taken.
        CommandFailed: it does not come back; the message says where to look.
        DriverError: the servo is silent or refuses.
    """
    bus, keep = bus_of(arguments), Keep(arguments.keep)
    new_id = 1 if keep is Keep.NOTHING else arguments.id
    new_baud = bus.baud if keep is Keep.ID_AND_BAUD else None
    with bus.open() as link:
        servo = link.servo(arguments.id, bus.joint(arguments.id))
        _require_alone(link, bus, servo.id)
        if keep not in link.keeps:
            can = " or ".join(one.value for one in link.keeps)
            raise UsageError(f"{servo}: a reset can keep {can}, not {arguments.keep}")
        if new_id != servo.id and is_taken(link, new_id):
            raise UsageError(f"{servo} would get the id {new_id}, which is taken; use --keep id")
        torque = _torque_question(link, [servo])
        confirm(arguments, f"{servo} forgets all settings but {arguments.keep}.{torque}")
        link.release(servo)
        link.factory_reset(servo, keep)
        new_baud = new_baud or link.factory_baud
    try:
        with bus.open(new_baud) as link:
            link.await_boot(new_id)
    except DriverError as error:
        raise CommandFailed(
            f"{servo}: was reset, but does not answer as id {new_id} at {new_baud} baud ({error}); "
            f"find it: vla-deploy servo scan --port {bus.port}"
        ) from error
    document = {"id": new_id, "old_id": servo.id, "baud": new_baud, "kept": arguments.keep}
    text = f"{servo}: factory settings; it answers as id {new_id} at {new_baud} baud"
    return emit(arguments, document, text, indent=None)
