"""`vla-deploy servo monitor`: a live table of what the servos sense; nothing is changed."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivers.clock import NS_PER_S
from drivers.dynamixel.control_table import CENTRE_PULSE, PULSE_RAD, VOLTAGE_UNIT_V
from drivers.dynamixel.fault_policy import describe_bits
from drivers.dynamixel.registers import decode
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tools import BenchLink, scan_speed
from drivers.dynamixel.tools.bench_link import THREE_TRIES
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.example import add_command
from vla_deploy.cli.number_arguments import number_within
from vla_deploy.cli.servo_wire import ServoWire, add_wire_arguments, servo_id, wire_of

STATUS = (64, 7)  # torque_enable .. hardware_error_status
SENSED = (124, 23)  # present_pwm .. present_temperature
COUNTERS = ("timeouts", "crc_errors", "retries", "late")


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Hold what one servo sensed; angles are of the servo, 0 at pulse 2048."""

    id: int
    joint: str
    model: str
    position_rad: float
    velocity_rad_s: float
    effort: float
    effort_unit: str
    voltage_v: float
    temperature_c: int
    torque_on: bool
    errors: str


def register(commands: Any) -> None:
    """Add the command."""
    monitor = add_command(
        commands,
        "monitor",
        "show what the servos sense, again and again",
        "  vla-deploy servo monitor --robot butler\n"
        "  vla-deploy servo monitor 1 2 --port /dev/ttyUSB0 --count 10 --json\n",
    )
    add_wire_arguments(monitor)
    monitor.add_argument("ids", type=servo_id, nargs="*", metavar="ID", help="default: all")
    monitor.add_argument(
        "--count", type=_count, default=0, metavar="N", help="stop after so many (default: never)"
    )
    monitor.add_argument(
        "--rate",
        type=number_within(0.1, 100.0, "0.1 to 100"),
        default=5.0,
        metavar="HZ",
        help="0.1 to 100 (default: 5)",
    )
    monitor.set_defaults(run=run)


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Print readings until the count is reached or Ctrl-C.

    Raises:
        CommandFailed: there is nothing to monitor.
        LinkLost: the adapter is gone.
    """
    wire = wire_of(arguments)
    period_ns = round(NS_PER_S / arguments.rate)
    with wire.open() as link:
        servos = _servos(arguments.ids, link, wire)
        sample, due_ns = 0, wire.clock.now_ns()
        while not arguments.count or sample < arguments.count:
            sample += 1
            _show(arguments.json, servos, link, _read(link, servos, wire))
            due_ns += period_ns
            if sample != arguments.count:
                wire.clock.sleep_until(due_ns)
    return 0


def _servos(ids: Sequence[int], link: BenchLink, wire: ServoWire) -> list[ServoSpec]:
    chosen = ids or sorted(wire.joints) or [one.servo_id for one in scan_speed(link).servos]
    if not chosen:
        raise CommandFailed(
            f"{wire.port}: no servo answers at {wire.baud} baud; see: vla-deploy servo scan"
        )
    return [link.servo(one, wire.joint(one)) for one in chosen]


def _read(link: BenchLink, servos: Sequence[ServoSpec], wire: ServoWire) -> list[Reading]:
    """Return the readings of the servos that answer; the counters tell of the others."""
    statuses = link.registers.read_span_many(servos, *STATUS, THREE_TRIES)
    spans = link.registers.read_span_many(servos, *SENSED, THREE_TRIES)
    return [
        _reading(servo, statuses[servo.id], spans[servo.id], wire.joint(servo.id))
        for servo in servos
        if servo.id in statuses and servo.id in spans
    ]


def _reading(servo: ServoSpec, status: bytes, span: bytes, joint: str) -> Reading:
    model, start = servo.model, SENSED[0]
    has_current = model.current_unit_a is not None
    effort = decode(servo, span, start, "present_current" if has_current else "present_load")
    return Reading(
        id=servo.id,
        joint=joint,
        model=model.name,
        position_rad=(decode(servo, span, start, "present_position") - CENTRE_PULSE) * PULSE_RAD,
        velocity_rad_s=decode(servo, span, start, "present_velocity") * model.velocity_unit_rad_s,
        effort=effort * (model.current_unit_a or 0.1),
        effort_unit="A" if has_current else "%",
        voltage_v=decode(servo, span, start, "present_input_voltage") * VOLTAGE_UNIT_V,
        temperature_c=decode(servo, span, start, "present_temperature"),
        torque_on=bool(decode(servo, status, STATUS[0], "torque_enable")),
        errors=describe_bits(decode(servo, status, STATUS[0], "hardware_error_status")),
    )


def _show(
    as_json: bool, servos: Sequence[ServoSpec], link: BenchLink, readings: Sequence[Reading]
) -> None:
    counters = {name: getattr(link.counters, name) for name in COUNTERS}
    answered = {reading.id for reading in readings}
    silent = [servo.id for servo in servos if servo.id not in answered]
    if as_json:
        rows = [_as_row(reading) for reading in readings]
        print(json.dumps({"servos": rows, "silent": silent, "counters": counters}), flush=True)
        return
    if sys.stdout.isatty():
        print("\033[H\033[2J", end="")
    print("\n".join(_lines(readings, silent, counters)), flush=True)


def _as_row(reading: Reading) -> dict[str, Any]:
    return {
        name: round(value, 6) if isinstance(value, float) else value
        for name in Reading.__slots__
        for value in (getattr(reading, name),)
    }


def _lines(
    readings: Sequence[Reading], silent: Sequence[int], counters: dict[str, int]
) -> list[str]:
    head = (
        f"{'id':>4} {'rad':>8} {'rad/s':>8} {'effort':>9} {'V':>5} {'C':>4} {'torque':>6}  "
        f"{'errors':<18} model"
    )
    rows = [
        f"{one.id:>4} {one.position_rad:>8.3f} {one.velocity_rad_s:>8.3f} "
        f"{one.effort:>7.3f} {one.effort_unit} {one.voltage_v:>5.1f} {one.temperature_c:>4} "
        f"{'on' if one.torque_on else 'off':>6}  {one.errors:<18} {one.model}  {one.joint}".rstrip()
        for one in readings
    ]
    gone = [f"{one:>4} silent" for one in silent]
    told = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in counters.items())
    return [head, *rows, *gone, f"wire: {told}"]
