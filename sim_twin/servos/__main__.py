"""Run `python -m sim_twin.servos --link PATH`: emulated servos on a pseudo-terminal.

Without --baud replies are there at once, whatever speed the host sets. With it the servos are set
to that rate, understand no other, and every byte takes its time.
"""

import argparse
import gc
import signal
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.dynamixel.tables.control_table import BAUD_RATES, MODELS
from drivers.dynamixel.wire.codec import MAX_SERVO_ID
from drivers.feetech.codec import FEETECH_MAX_ID
from drivers.feetech.table import FEETECH_BAUD_RATES, FEETECH_MODELS
from sim_twin.priority import claim_priority
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.server import (
    FreeBank,
    FreeFeetechServos,
    FreeRobotServos,
    FreeServos,
    make_feetech_specs,
    make_specs,
    serve,
)
from vla_deploy.robots import RobotFileError, load_robot

_EXAMPLE = """examples:
  python -m sim_twin.servos --robot so101 --link /tmp/servos
  python -m sim_twin.servos --link /tmp/servos --baud 1000000 --return-delay-us 0
  python -m sim_twin.servos --family feetech --servos 6 --models STS3215-C018 --link /tmp/servos"""
_MAX_RETURN_DELAY_US = 508


@dataclass(frozen=True, slots=True, kw_only=True)
class _Family:
    """Hold what one family of servos has to choose from."""

    models: Collection[str]
    usual_model: str
    baud_rates: Mapping[int, int]
    max_id: int
    build: Callable[[int, Sequence[str], Mapping[str, int], WireTiming | None], FreeBank]


_FAMILIES: Final[Mapping[str, _Family]] = {
    "dynamixel": _Family(
        models=MODELS,
        usual_model="XM430-W350",
        baud_rates=BAUD_RATES,
        max_id=MAX_SERVO_ID,
        build=lambda count, models, eeprom, timing: FreeServos(
            make_specs(count, models, eeprom), timing=timing
        ),
    ),
    "feetech": _Family(
        models=FEETECH_MODELS,
        usual_model="STS3215-C018",
        baud_rates=FEETECH_BAUD_RATES,
        max_id=FEETECH_MAX_ID,
        build=lambda count, models, eeprom, timing: FreeFeetechServos(
            make_feetech_specs(count, models, eeprom), timing=timing
        ),
    ),
}


def _models_line(family: str) -> str:
    return f"  {family}: {', '.join(sorted(_FAMILIES[family].models))}"


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m sim_twin.servos",
        description=__doc__,
        epilog="\n".join((_EXAMPLE, "models:", *map(_models_line, _FAMILIES))),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--link", type=Path, required=True, help="path of the link to the terminal")
    parser.add_argument(
        "--robot", help="be this robot's servos, each on a free shaft with the stops of its MJCF"
    )
    parser.add_argument(
        "--horn-off-pulses", type=float, default=0.0, help="how far the robot's horns sit wrong"
    )
    parser.add_argument("--family", choices=_FAMILIES, default="dynamixel")
    parser.add_argument("--servos", type=int, default=16, help="how many, with ids from 1")
    parser.add_argument(
        "--models",
        nargs="+",
        metavar="MODEL",
        help="in turn; each has the voltage it is made for",
    )
    parser.add_argument("--seconds", type=float, help="stop after this time; else run until killed")
    rates = {rate for family in _FAMILIES.values() for rate in family.baud_rates.values()}
    parser.add_argument("--baud", type=int, choices=sorted(rates), help="let bytes take their time")
    parser.add_argument("--return-delay-us", type=int, help="of every servo; as delivered: 500")
    parser.add_argument(
        "--latency-timer-ms", type=float, default=0.0, help="of the USB adapter; as delivered: 16"
    )
    parser.add_argument("--jitter-us", type=float, default=0.0, help="longest additional delay")
    parser.add_argument("--seed", type=int, default=0, help="of the jitter")
    options = parser.parse_args(arguments)
    options.models = options.models or [_FAMILIES[options.family].usual_model]
    _check(parser, options)
    return options


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.robot is not None:
        try:
            options.robot = load_robot(options.robot)
        except RobotFileError as error:
            parser.error(f"--robot: {error}")
    family = _FAMILIES[options.family]
    if not 1 <= options.servos <= family.max_id:
        parser.error(f"--servos: expected 1..{family.max_id}, got {options.servos}")
    for model in options.models:
        if model not in family.models:
            expected = ", ".join(sorted(family.models))
            parser.error(f"--models: {options.family} has {expected}; got {model}")
    if options.baud is not None and options.baud not in family.baud_rates.values():
        expected = ", ".join(map(str, sorted(family.baud_rates.values())))
        parser.error(f"--baud: {options.family} has {expected}; got {options.baud}")
    if not 0 <= (options.return_delay_us or 0) <= _MAX_RETURN_DELAY_US:
        parser.error(
            f"--return-delay-us: expected 0..{_MAX_RETURN_DELAY_US}, got {options.return_delay_us}"
        )
    for name in ("latency_timer_ms", "jitter_us"):
        value, flag = getattr(options, name), "--" + name.replace("_", "-")
        if value < 0.0:
            parser.error(f"{flag}: expected 0 or more, got {value}")
        if value and options.baud is None:
            parser.error(f"{flag}: only a paced bus has it; give --baud too")


def _build(options: argparse.Namespace) -> FreeBank:
    if options.robot is not None:
        return FreeRobotServos(
            options.robot, _timing(options), horn_off_pulses=options.horn_off_pulses
        )
    family = _FAMILIES[options.family]
    eeprom = {}
    if options.return_delay_us is not None:
        eeprom["return_delay_time"] = options.return_delay_us // 2
    if options.baud is not None:
        eeprom["baud_rate"] = {rate: value for value, rate in family.baud_rates.items()}[
            options.baud
        ]
    return family.build(options.servos, options.models, eeprom, _timing(options))


def _timing(options: argparse.Namespace) -> WireTiming | None:
    if options.baud is None:
        return None
    return WireTiming(
        baud=options.baud,
        latency_timer_s=options.latency_timer_ms / 1e3,
        jitter_s=options.jitter_us / 1e6,
        seed=options.seed,
    )


def main(arguments: Sequence[str]) -> int:
    """Serve until the time is over, SIGINT or SIGTERM."""
    options = _parse(arguments)
    clock = MonotonicClock()
    stop_ns = clock.now_ns() + round((options.seconds or 0.0) * NS_PER_S)
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stopped.append(received))
    servos = _build(options)
    gc.freeze()  # a full collection takes longer than a reply
    claim_priority()
    serve(
        servos,
        options.link,
        clock,
        lambda: bool(stopped) or (options.seconds is not None and clock.now_ns() >= stop_ns),
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
