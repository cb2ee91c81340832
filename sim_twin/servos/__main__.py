"""Run `python -m sim_twin.servos --link PATH`: emulated servos on a pseudo-terminal."""

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.dynamixel.codec import MAX_SERVO_ID
from drivers.dynamixel.control_table import MODELS
from sim_twin.servos.server import FreeServos, make_specs, serve


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_twin.servos", description=__doc__)
    parser.add_argument("--link", type=Path, required=True, help="path of the link to the terminal")
    parser.add_argument("--servos", type=int, default=16, help="how many, with ids from 1")
    parser.add_argument(
        "--models", nargs="+", choices=sorted(MODELS), default=["XM430-W350"], help="in turn"
    )
    parser.add_argument("--seconds", type=float, help="stop after this time; else run until killed")
    options = parser.parse_args(arguments)
    if not 1 <= options.servos <= MAX_SERVO_ID:
        parser.error(f"--servos: expected 1..{MAX_SERVO_ID}, got {options.servos}")
    return options


def main(arguments: Sequence[str]) -> int:
    """Serve until the time is over, SIGINT or SIGTERM."""
    options = _parse(arguments)
    clock = MonotonicClock()
    stop_ns = clock.now_ns() + round((options.seconds or 0.0) * NS_PER_S)
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stopped.append(received))
    servos = FreeServos(make_specs(options.servos, options.models))
    serve(
        servos,
        options.link,
        clock,
        lambda: bool(stopped) or (options.seconds is not None and clock.now_ns() >= stop_ns),
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
