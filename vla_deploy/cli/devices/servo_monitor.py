"""`vla-deploy servo monitor`: a live table of what the servos sense; nothing is changed."""

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final

from drivers.clock import NS_PER_S
from drivers.servo.joint_servo import JointServo
from drivers.servo.tools.bench import ServoBench, ServoReading
from drivers.servo.tools.scan import scan_speed
from vla_deploy.cli.commands import add_command, number_within, whole_number
from vla_deploy.cli.devices.servo_bus import ServoBusPort, add_bus_arguments, bus_of, servo_id
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.terminal import CLEAR_SCREEN, control

COUNTERS: Final = ("timeouts", "crc_errors", "retries", "late")
EXAMPLES: Final = """  vla-deploy servo monitor --robot butler
  vla-deploy servo monitor 1 2 --port /dev/ttyUSB0 --count 10 --json
"""


def register(commands: Any) -> None:
    """Add the command."""
    monitor = add_command(
        commands, "monitor", "show repeatedly what the servos sense", EXAMPLES, run
    )
    add_bus_arguments(monitor)
    monitor.add_argument("ids", type=servo_id, nargs="*", metavar="ID", help="default: all")
    monitor.add_argument(
        "--count",
        type=whole_number(),
        default=0,
        metavar="N",
        help="stop after so many (default: never)",
    )
    monitor.add_argument(
        "--rate",
        type=number_within(0.1, 100.0, "0.1 to 100"),
        default=5.0,
        metavar="HZ",
        help="0.1 to 100 (default: 5)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print readings until the count is reached or Ctrl-C.

    Raises:
        CommandFailed: there is nothing to monitor.
        LinkLost: the adapter is gone.
    """
    bus = bus_of(arguments)
    period_ns = round(NS_PER_S / arguments.rate)
    with bus.open() as link:
        servos = _servos(arguments.ids, link, bus)
        sample, due_ns = 0, bus.clock.now_ns()
        while not arguments.count or sample < arguments.count:
            sample += 1
            _show(arguments.json, servos, link, link.read_servos(servos, bus.joints))
            due_ns += period_ns
            if sample != arguments.count:
                bus.clock.sleep_until(due_ns)
    return 0


def _servos(ids: Sequence[int], link: ServoBench, bus: ServoBusPort) -> list[JointServo]:
    chosen = ids or sorted(bus.joints) or [one.servo_id for one in scan_speed(link).servos]
    if not chosen:
        raise CommandFailed(
            f"{bus.port}: no servo answers at {bus.baud} baud; see: vla-deploy servo scan"
        )
    return [link.servo(one, bus.joint(one)) for one in chosen]


def _show(
    as_json: bool, servos: Sequence[JointServo], link: ServoBench, readings: Sequence[ServoReading]
) -> None:
    counters = {name: getattr(link.counters, name) for name in COUNTERS}
    answered = {reading.id for reading in readings}
    silent = [servo.id for servo in servos if servo.id not in answered]
    if as_json:
        rows = [_rounded(asdict(reading)) for reading in readings]
        print(json.dumps({"servos": rows, "silent": silent, "counters": counters}), flush=True)
        return
    if sys.stdout.isatty():
        control(CLEAR_SCREEN)
    print("\n".join(_lines(readings, silent, counters)), flush=True)


def _rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: round(value, 6) if isinstance(value, float) else value for name, value in row.items()
    }


def _lines(
    readings: Sequence[ServoReading], silent: Sequence[int], counters: Mapping[str, int]
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
    counts = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in counters.items())
    return [head, *rows, *gone, f"wire: {counts}"]
