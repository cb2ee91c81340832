"""`vla-deploy servo scan | ping | info`: see what is on a servo bus; nothing is changed."""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final

from drivers.clock import NS_PER_S
from drivers.errors import NoReply
from drivers.servo.tools.bench import FoundServo, ServoBench
from drivers.servo.tools.scan import (
    ServoScan,
    SpeedReport,
    scan_speed,
)
from drivers.servo.trouble import TroubleLevel
from vla_deploy.cli.commands import add_command, emit
from vla_deploy.cli.devices.servo_bus import (
    ProgressLine,
    ServoBusPort,
    add_bus_arguments,
    bus_of,
    servo_id,
)
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.robots.servos.survey import ServoSurvey, survey

_SCAN_EXAMPLES: Final = """  vla-deploy servo scan --port /dev/ttyUSB0
  vla-deploy servo scan --robot butler --json
  vla-deploy servo scan --port /dev/ttyUSB0 --baud 57600 --ids 1-20
"""


def register(commands: Any) -> None:
    """Add the commands."""
    summary = "find all servos, at every speed unless --baud names one"
    scan = add_command(commands, "scan", summary, _SCAN_EXAMPLES, run_scan)
    example = "  vla-deploy servo ping 1 2 --robot butler\n"
    ping = add_command(commands, "ping", "ask servos for model and firmware", example, run_ping)
    example = "  vla-deploy servo info 3\n"
    info = add_command(commands, "info", "print every register of a servo", example, run_info)
    for command in (scan, ping, info):
        add_bus_arguments(command)
    scan.add_argument("--ids", type=_id_range, metavar="A-B", help="ask these ids one by one")
    ping.add_argument("ids", type=servo_id, nargs="+", metavar="ID")
    info.add_argument("id", type=servo_id)


def _id_range(text: str) -> Sequence[int]:
    first, dash, last = text.partition("-")
    low, high = servo_id(first), servo_id(last if dash else first)
    if low > high:
        raise argparse.ArgumentTypeError(f"expected the smaller id first, got {text!r}")
    return range(low, high + 1)


def run_scan(arguments: argparse.Namespace) -> int:
    """Print what answers at each speed.

    Raises:
        CommandFailed: nothing answers, ids clash, or a declared servo is missing, is another, or
            holds or measures what would keep it from torque.
    """
    bus = bus_of(arguments)
    progress = ProgressLine(quiet=arguments.json)
    reports: list[SpeedReport] = []
    surveys: list[ServoSurvey] = []
    try:
        for baud in speeds_to_ask(bus):
            with bus.open(baud) as link:
                expected = () if reports else bus.declared
                reports.append(scan_speed(link, arguments.ids, progress, expected))
                if bus.robot is not None:
                    surveys.append(survey(bus.robot, link, reports[-1]))
            if bus.is_pseudo_terminal and reports[-1].servos:
                break  # servos without a speed answer at each
    finally:
        progress.clear()
    scan = ServoScan(
        port=str(bus.port),
        reports=reports,
        declared=bus.declared,
        is_complete=arguments.ids is None,
    )
    troubles = [*scan.strays(), *(one for each in surveys for one in each.troubles)]
    document = {
        **_scan_document(bus, scan),
        "wrong_voltages": [line for one in surveys for line in one.wrong_voltages],
        "troubles": [*map(str, [*scan.troubles(), *troubles])],
    }
    notes = [f"note: {one}" for one in troubles if one.level is TroubleLevel.NOTE]
    emit(arguments, document, "\n".join([*_scan_lines(bus, reports), *notes]))
    faults = [str(one) for one in troubles if one.level > TroubleLevel.NOTE]
    if faults := [*filter(None, [scan.fault()]), *faults]:
        raise CommandFailed("\n".join(faults))
    return 0


def speeds_to_ask(bus: ServoBusPort) -> Sequence[int]:
    """Return the speeds at which servos are looked for, the bus' own first."""
    if bus.baud_given:
        return (bus.baud,)
    return (bus.baud, *(speed for speed in bus.speeds if speed != bus.baud))


def _scan_document(bus: ServoBusPort, scan: ServoScan) -> dict[str, Any]:
    reports = scan.reports
    return {
        "port": scan.port,
        "servos": [
            {"baud": report.baud, **_row(bus, servo)}
            for report in reports
            for servo in report.servos
        ],
        "clashes": [
            {"baud": report.baud, "id": one} for report in reports for one in report.clashes
        ],
        "other_family": [
            {"baud": report.baud, "id": one}
            for report in reports
            for one in report.other_family_ids
        ],
        "noise_bytes": {report.baud: report.noise_bytes for report in reports},
        "missing": scan.missing,
    }


def _row(bus: ServoBusPort, servo: FoundServo) -> dict[str, Any]:
    """Return a servo's row of the JSON document."""
    return {
        "id": servo.servo_id,
        "joint": bus.joint(servo.servo_id) or None,
        "model": servo.model_name,
        "model_number": servo.model_number,
        "firmware": servo.firmware,
    }


def _scan_lines(bus: ServoBusPort, reports: Sequence[SpeedReport]) -> list[str]:
    rows = [
        f"{one.servo_id:>4}  {report.baud:>8}  {one.model_name:<14} {one.firmware:>8}  "
        f"{bus.joint(one.servo_id)}".rstrip()
        for report in reports
        for one in report.servos
    ]
    head = [f"{'id':>4}  {'baud':>8}  {'model':<14} {'firmware':>8}" + "  joint" * bool(bus.joints)]
    speeds = [report.baud for report in reports if report.servos]
    hints = [
        f"servos at {len(speeds)} speeds ({', '.join(map(str, speeds))}): on one bus all need the "
        "same; see: vla-deploy servo set-baud --help"
    ]
    return [*(head if rows else []), *rows, *(hints if len(speeds) > 1 else [])]


def run_ping(arguments: argparse.Namespace) -> int:
    """Print the servos that answer.

    Raises:
        CommandFailed: one of them does not; the others are printed.
    """
    bus = bus_of(arguments)
    rows, silent = [], []
    with bus.open() as link:
        for one in arguments.ids:
            try:
                rows.append(_pinged(link, bus, one))
            except NoReply:
                silent.append(bus.label(one))
                continue
            if not arguments.json:
                print(_ping_line(bus, rows[-1]), flush=True)
    if arguments.json:
        print(json.dumps(rows, indent=2))
    if silent:
        raise CommandFailed(
            f"{bus.port} at {bus.baud} baud: no answer from {', '.join(silent)}; check power, "
            "cable, id and speed; see: vla-deploy servo scan"
        )
    return 0


def _ping_line(bus: ServoBusPort, row: Mapping[str, Any]) -> str:
    return (
        f"{bus.label(row['id'])}: {row['model']}, firmware {row['firmware']}, "
        f"{1e3 * row['round_trip_s']:.2f} ms"
    )


def _pinged(link: ServoBench, bus: ServoBusPort, one: int) -> dict[str, Any]:
    start_ns = bus.clock.now_ns()
    servo = link.ping(one)
    taken_s = (bus.clock.now_ns() - start_ns) / NS_PER_S
    return {**_row(bus, servo), "round_trip_s": taken_s}


def run_info(arguments: argparse.Namespace) -> int:
    """Print every register.

    Raises:
        ServoSilent: the servo does not answer.
        WrongServo: its registers are not known.
    """
    bus = bus_of(arguments)
    with bus.open() as link:
        found = link.ping(arguments.id)
        servo = link.servo(arguments.id)
        registers = link.registers(servo)
    lines = [f"{bus.label(arguments.id)}: {found.model_name}, firmware {found.firmware}"]
    for one in registers:
        kind = "EEPROM" if one.eeprom else "RAM"
        default = "" if one.initial is None else f"  factory {one.initial}"
        changed = " *" if one.initial not in (None, one.value) and one.eeprom else ""
        value = f"{one.name:<24}{one.value:>10}"
        lines.append(f"{one.address:>5}  {value}  {kind:<6}{default}{changed}")
    document = {one.name: asdict(one) for one in registers}
    return emit(arguments, {**_row(bus, found), "registers": document}, "\n".join(lines))
