"""`vla-deploy doctor | probes`: what is wrong with this computer, and what it measures."""

import argparse
import json
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import load_profile
from platforms.probes import ProbeSet, Reading, open_probes, read_power_modes
from platforms.tree import Tree
from vla_deploy import doctor
from vla_deploy.cli.commands import add_top_command, number_within
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import base_of
from vla_deploy.robots import load_robot
from vla_deploy.runtime.state_dir import models_dir_of
from vla_deploy.supervisor.profiles.profile_choice import StartProfile, detect, start_profile

LIVE_ROOT = Path("/")
FIRST_READ_S = 0.5  # counters need two readings
_SCALES: Mapping[str, tuple[float, str]] = {
    "bytes": (1e-6, "MB"),
    "ratio": (100.0, "%"),
    "Hz": (1e-6, "MHz"),
}


def register(commands: Any) -> None:
    """Add the commands."""
    examined = add_top_command(
        commands,
        "doctor",
        "  vla-deploy doctor\n"
        "  vla-deploy doctor --robot so101\n"
        "  vla-deploy doctor --robot butler --profile jetson_orin_nx\n"
        "  vla-deploy doctor --json | jq '.findings[] | select(.level == \"fail\")'\n",
        run,
        json_help="print JSON",
    )
    examined.add_argument("--robot", metavar="NAME", help="also check the devices of this robot")
    examined.add_argument(
        "--profile", metavar="NAME", help="what is needed (default: as run has it)"
    )
    probes = add_top_command(
        commands,
        "probes",
        "  vla-deploy probes\n  vla-deploy probes --watch 1\n  vla-deploy probes --json\n",
        run_probes,
        json_help="print JSON",
    )
    probes.add_argument(
        "--watch",
        type=number_within(0.05, 3600.0, "0.05 to 3600 seconds"),
        metavar="S",
        help="again every S seconds",
    )
    for command in (examined, probes):
        command.add_argument(
            "--root",
            type=Path,
            default=LIVE_ROOT,
            metavar="DIR",
            help="a recorded tree of another computer",
        )


def run(arguments: argparse.Namespace) -> int:
    """Print the findings; return 1 where one is a failure."""
    root = _root(arguments)
    robot = None if arguments.robot is None else load_robot(arguments.robot)
    start = _start_profile(arguments.profile, root, arguments.runtime_base)
    profile = load_profile(start.name)
    if root == LIVE_ROOT:
        models = models_dir_of(base_of(arguments))
        context = doctor.live_context(profile, robot, models, start.fault)
    else:
        context = doctor.recorded_context(root, profile, robot)
    sections = doctor.examine(context)
    if arguments.json:
        print(json.dumps(doctor.as_document(sections), indent=2))
    else:
        print(doctor.as_text(sections))
    return 0 if doctor.succeeded(sections) else 1


def _root(arguments: argparse.Namespace) -> Path:
    root: Path = arguments.root
    if not root.is_dir():
        raise UsageError(f"--root {root}: expected a folder")
    return root


def _start_profile(name: str | None, root: Path, base: Path | None) -> StartProfile:
    """Return the profile that is named, or that a run would take."""
    if name is not None:
        return StartProfile(name=name, why="given")
    if root == LIVE_ROOT:
        return start_profile(base)
    found, why = detect(root)
    return StartProfile(name=found, why=why)


def run_probes(arguments: argparse.Namespace) -> int:
    """Print the readings once, or repeatedly until Ctrl-C."""
    root, clock = _root(arguments), MonotonicClock()
    with open_probes(root) as probes:
        _wait(clock, FIRST_READ_S)
        _show(probes, root, as_json=arguments.json)
        while arguments.watch is not None:
            _wait(clock, arguments.watch)
            _show(probes, root, as_json=arguments.json)
    return 0


def _wait(clock: Clock, seconds: float) -> None:
    clock.sleep_until(clock.now_ns() + round(seconds * NS_PER_S))


def _show(probes: ProbeSet, root: Path, *, as_json: bool) -> None:
    readings = probes.read()
    if as_json:
        rows = {name: _without_name(reading) for name, reading in readings.items()}
        print(json.dumps(rows), flush=True)
    else:
        print("\n".join([*_lines(readings), _mode_line(root), ""]), flush=True)


def _without_name(reading: Reading) -> dict[str, Any]:
    return {key: value for key, value in asdict(reading).items() if key != "name"}


def _lines(readings: Mapping[str, Reading]) -> Iterator[str]:
    for name, reading in readings.items():
        if reading.value is not None:
            factor, unit = _SCALES.get(reading.unit, (1.0, reading.unit))
            yield f"{name:<34} {reading.value * factor:>12.6g} {unit}"
    by_reason: dict[str, list[str]] = {}
    for name, reading in readings.items():
        if reading.value is None:
            by_reason.setdefault(reading.reason, []).append(name)
    for reason, names in by_reason.items():
        yield from textwrap.wrap(f"{', '.join(names)}: {reason}", 100, subsequent_indent="    ")


def _mode_line(root: Path) -> str:
    modes = read_power_modes(Tree(root))
    name = modes.current_name
    return f"{'power mode':<34} {name or '-':>12} {'' if name else modes.reason}".rstrip()
