"""Look at the servo bus of a robot that does not run: who holds its port, who answers, and how.

Nothing is written, and a port that another process holds is left alone.
"""

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from drivers.base import ByteTransport, TunableTransport
from drivers.errors import DriverError
from drivers.servo.tools.scan import ServoScan, SpeedReport, scan_speed
from drivers.servo.trouble import ServoTrouble, TroubleLevel
from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, warn
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.servos.declared import bus_family
from vla_deploy.robots.servos.guard import GUARD_PAGE, GUARD_REMEDY, unguarded_servos
from vla_deploy.robots.servos.survey import ServoSurvey, survey

_PORT: Final = "servo port"
_SERVOS: Final = "servo bus"
_GUARD: Final = "servo guard"
_COMMAND: Final = re.compile("`(vla-deploy [^`]+)`")
_GRABBERS: Final = {
    "ModemManager": "sudo systemctl disable --now ModemManager",
    "brltty": "sudo apt remove brltty",
}
"""Programs that open new serial ports by themselves, and how to be rid of them."""


def port_users(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that nobody else has the port open, or would open it."""
    port = _port(context)
    if port is None:
        return
    for name, pid in _holders(context, port):
        measured = f"{port.name} is open in {name} (process {pid}), expected in none"
        yield warn(_PORT, measured, f"kill {pid}   # or stop it as it was started")
    for name in sorted(set(_running(context).values()) & _GRABBERS.keys()):
        yield warn(_PORT, f"{name} runs, which opens serial ports on its own", _GRABBERS[name])


def servos_on_the_bus(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the servos are those of the robot file, and fit for torque."""
    port, robot = _port(context), context.robot
    if port is None or robot is None:
        return  # the check of the device files names it
    if holders := _holders(context, port):
        names = ", ".join(f"{name} (process {pid})" for name, pid in holders)
        yield missing(_SERVOS, f"not asked, since {names} has their port")
        return
    try:
        scan, found = _look(context, port, robot)
    except DriverError as error:
        yield missing(_SERVOS, str(error))
        return
    troubles = [*scan.troubles(), *scan.strays(), *found.troubles]
    yield from (_finding(one, robot) for one in troubles)
    if not any(one.level > TroubleLevel.NOTE for one in troubles):
        low_v, high_v = min(found.volts.values()), max(found.volts.values())
        measured = (
            f"{len(found.volts)} of {len(scan.declared)} at {scan.reports[0].baud} baud, "
            f"{low_v:.1f} V to {high_v:.1f} V as declared"
        )
        yield ok(_SERVOS, measured)


def servo_guard(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that something ends the servos' torque where the computer dies."""
    if context.robot is None:
        return
    if lacks := unguarded_servos(context.robot):
        yield warn(_GUARD, lacks, f"see {GUARD_PAGE}   # {GUARD_REMEDY}")
    else:
        relay, by = context.robot.power_relay, "stopped by their bus watchdog"
        if relay is not None and relay.hold_s is not None:
            by = f"without supply {relay.hold_s:g} s after the last pulse"
        yield ok(_GUARD, "only read" if context.robot.read_only else by)


def _finding(trouble: ServoTrouble, robot: RobotDescription) -> DoctorFinding:
    """Put the first command of the remedy in front, or the one that shows whether it helped."""
    judge = warn if trouble.level is TroubleLevel.NOTE else fail
    named = _COMMAND.search(trouble.remedy)
    command = named[1] if named else "vla-deploy servo scan"
    return judge(_SERVOS, trouble.measured, f"{command} --robot {robot.name}   # {trouble.remedy}")


def _look(
    context: DoctorContext, port: Path, robot: RobotDescription
) -> tuple[ServoScan, ServoSurvey]:
    """Ask at the bus' own speed, and for those who are silent there at the others."""
    bus, family = robot.servo_bus, bus_family(robot)
    declared = {one.id: (one.joint, one.model) for one in bus.all_servos}
    transport = context.open_serial(port, bus.baud, context.clock)
    try:
        bench = family.bench(transport, context.clock, bus.baud)
        bench.detect_echo()
        reports = [scan_speed(bench, expected=declared)]
        found = survey(robot, bench, reports[0])
        scan = ServoScan(
            port=bus.path,
            reports=reports,
            declared=declared,
            is_complete=True,
        )
        if (silent := scan.missing) and not _is_pseudo_terminal(port):
            reports += _at_other_speeds(context, transport, robot, silent)
    finally:
        transport.close()
    return scan, found


def _at_other_speeds(
    context: DoctorContext, transport: ByteTransport, robot: RobotDescription, silent: list[int]
) -> Iterator[SpeedReport]:
    """Ask silent servos at every other speed that both they and the port have."""
    family = bus_family(robot)
    if not isinstance(transport, TunableTransport):
        return
    rates = {*transport.bauds} & {*family.baud_rates} - {robot.servo_bus.baud}
    for baud in sorted(rates, reverse=True):
        transport.set_baud(baud)
        yield scan_speed(family.bench(transport, context.clock, baud), silent)


def _is_pseudo_terminal(port: Path) -> bool:
    """Return whether a port is the twin's, which has no speed and which the twin itself holds."""
    return str(port.resolve()).startswith("/dev/pts/")


def _port(context: DoctorContext) -> Path | None:
    """Return the port of the robot's servos, where there is one."""
    if context.robot is None:
        return None
    port = context.tree.root / context.robot.servo_bus.path.lstrip("/")
    return port if port.exists() else None


def _holders(context: DoctorContext, port: Path) -> list[tuple[str, int]]:
    """Return name and number of other processes that have the port open, as far as we may see."""
    device, found = port.resolve(), list[tuple[str, int]]()
    if _is_pseudo_terminal(port):
        return found
    for pid, name in _running(context).items():
        folder = context.tree.root / "proc" / str(pid) / "fd"
        with suppress(OSError):  # another user's, or it has just ended
            if pid != os.getpid() and any(one.resolve() == device for one in folder.iterdir()):
                found.append((name, pid))
    return found


def _running(context: DoctorContext) -> dict[int, str]:
    """Return the names of all processes by their numbers."""
    found = {}
    for name in context.tree.names("/proc"):
        if name.isdecimal():
            with suppress(ValueMissing):
                found[int(name)] = context.tree.text(f"/proc/{name}/comm").strip()
    return found
