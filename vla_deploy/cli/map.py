"""`vla-deploy map record | show | check | convert`: maps in the ROS format."""

import argparse
import dataclasses
import json
import math
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_command, add_top_command
from vla_deploy.cli.session import attach
from vla_deploy.ipc import SharedSpace
from vla_deploy.navigation.maps.map_check import as_characters, check_for_robot, describe
from vla_deploy.navigation.maps.map_file import (
    MapFile,
    MapMode,
    image_of,
    read_map_file,
    write_map_file,
)
from vla_deploy.robots import load_robot

EXAMPLES: Final = """  vla-deploy map record maps/home.yaml        drive it around, then Ctrl-C
  vla-deploy map check maps/home.yaml
  vla-deploy map show maps/home.yaml --png home.png
  vla-deploy map convert old.yaml maps/home.yaml
"""
_TELL_EVERY_S: Final = 5.0
_STEP_S: Final = 0.02
_LEAST_SCANS: Final = 10


def register(commands: Any) -> None:
    """Add the command."""
    acts = add_top_command(commands, "map", EXAMPLES).add_subparsers(
        dest="act", required=True, metavar="ACT"
    )
    record = add_command(acts, "record", "draw a map while the robot is driven around", EXAMPLES)
    record.add_argument("map", type=Path, help="the YAML file to write; its image lies beside it")
    record.add_argument("--robot", default="butler", help="name or folder (default: butler)")
    record.add_argument(
        "--seconds", type=_seconds, default=math.inf, help="end then (default: at Ctrl-C)"
    )
    record.add_argument("--resolution", type=_metres, default=0.05, help="of a cell (0.05 m)")
    record.add_argument("--replace", action="store_true", help="replace a map of that name")
    show = add_command(acts, "show", "draw a map in the terminal, or into a PNG", EXAMPLES)
    show.add_argument("--png", type=Path, metavar="FILE", help="write an image instead")
    check = add_command(acts, "check", "tell what a map holds and whether it fits", EXAMPLES)
    check.add_argument("--robot", help="name or folder: does it fit there, does it get about")
    convert = add_command(
        acts, "convert", "write a map of any mode and image as a trinary PGM", EXAMPLES
    )
    for act in (show, check, convert):
        act.add_argument("map", type=Path, help="its YAML file")
    convert.add_argument("to", type=Path, help="the YAML file to write; its image lies beside it")
    convert.add_argument("--replace", action="store_true", help="replace a map of that name")
    for name, run in _RUNS.items():
        acts.choices[name].add_argument("--json", action="store_true", help="print JSON")
        acts.choices[name].set_defaults(run=run)


def run_record(arguments: argparse.Namespace) -> int:
    """Draw a map until Ctrl-C, then write it."""
    from vla_deploy.perception.map_recorder import MapRecorder  # takes pinocchio with it

    _require_free(arguments.map, replace=arguments.replace)
    session = attach(arguments.runtime_base)
    space = SharedSpace(session.run_dir / "ipc", session.clock)
    recorder = MapRecorder(load_robot(arguments.robot), space, arguments.resolution)
    if not arguments.json:
        frame = "of the present map" if recorder.on_old_frame else "that begins here"
        print(f"recording in the frame {frame}; drive slowly through every room, then Ctrl-C")
    _record(session, recorder, arguments)
    space.close()
    session.close()
    mapper = recorder.mapper
    if mapper.scans < _LEAST_SCANS:
        raise CommandFailed(
            f"only {mapper.scans} scans came in {arguments.seconds:g} s, so there is no map; "
            "does the lidar run? vla-deploy status"
        )
    file = mapper.grid.map_file()
    write_map_file(arguments.map, file, comment="Recorded by `vla-deploy map record`.")
    told = describe(file) | {"scans": mapper.scans, "refused_scans": mapper.refused}
    _print(told | {"map": str(arguments.map)}, arguments.json)
    return 0


def _record(session: Any, recorder: Any, arguments: argparse.Namespace) -> None:
    """Feed the recorder until the time is over or somebody presses Ctrl-C."""
    steps, mapper = 0, recorder.mapper
    try:
        while steps * _STEP_S < arguments.seconds:
            recorder.step()
            session.pause(_STEP_S)
            steps += 1
            if not arguments.json and steps % round(_TELL_EVERY_S / _STEP_S) == 0:
                free_m2 = describe(mapper.grid.map_file())["free_m2"]
                print(f"{mapper.scans} scans, {mapper.refused} refused, {free_m2:.1f} m2 free")
    except KeyboardInterrupt:
        if not arguments.json:
            print()


def run_show(arguments: argparse.Namespace) -> int:
    """Draw a map."""
    file = read_map_file(arguments.map)
    if arguments.png is not None:
        if arguments.png.suffix.lower() != ".png":
            raise UsageError(f"{arguments.png}: expected a name that ends in .png")
        if not cv2.imwrite(str(arguments.png), file.shades):
            raise CommandFailed(f"{arguments.png}: cannot write the image")
        _print({"png": str(arguments.png)}, arguments.json)
        return 0
    _print(describe(file), arguments.json)
    if not arguments.json:
        print(as_characters(file))
    return 0


def run_check(arguments: argparse.Namespace) -> int:
    """Tell what a map holds; 1 where the robot cannot live on it."""
    file = read_map_file(arguments.map)
    told = describe(file)
    faults: list[str] = []
    if arguments.robot is not None:
        more, faults = check_for_robot(file, load_robot(arguments.robot))
        told |= more
    _print(told | {"faults": faults}, arguments.json)
    return 1 if faults else 0


def run_convert(arguments: argparse.Namespace) -> int:
    """Write a map anew: trinary, not negated, as a PGM."""
    written = {one.resolve() for one in _written(arguments.to)}
    if arguments.map.resolve() in written or image_of(arguments.map).resolve() in written:
        raise UsageError(f"{arguments.to}: choose another file, the map itself is kept")
    _require_free(arguments.to, replace=arguments.replace)
    file = read_map_file(arguments.map)
    write_map_file(arguments.to, as_trinary(file))
    _print({"map": str(arguments.to)}, arguments.json)
    return 0


def _written(to: Path) -> tuple[Path, Path]:
    return to, to.with_suffix(".pgm")


def _require_free(to: Path, *, replace: bool) -> None:
    """Accept that a map is written.

    Raises:
        UsageError: one of its files is there, and is not to be replaced.
    """
    there = [str(one) for one in _written(to) if one.exists()]
    if there and not replace:
        raise UsageError(f"{' and '.join(there)} is there already; choose another, or: --replace")


def as_trinary(file: MapFile) -> MapFile:
    """Return the map with the shades that map_server writes; what it calls low stays dark grey."""
    from vla_deploy.navigation.maps.map_file import FREE_SHADE, OCCUPIED_SHADE, UNKNOWN_SHADE

    if file.mode is MapMode.TRINARY and not file.negate:
        return file
    probability = np.flipud(file.probability())
    shades = np.full(probability.shape, UNKNOWN_SHADE, dtype=np.uint8)
    shades[probability > file.occupied_thresh] = OCCUPIED_SHADE
    shades[probability < file.free_thresh] = FREE_SHADE
    return dataclasses.replace(
        file,
        shades=shades,
        mode=MapMode.TRINARY,
        negate=False,
        occupied_thresh=0.65,
        free_thresh=0.196,
    )


def _print(told: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(told, indent=2))
        return
    for name, value in told.items():
        for line in value if name == "faults" else [f"{name}: {value}"]:
            print(line)


def _seconds(text: str) -> float:
    return _above_zero(text, "seconds")


def _metres(text: str) -> float:
    return _above_zero(text, "metres")


def _above_zero(text: str, unit: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"expected {unit} above 0, got {text!r}")
    return value


_RUNS: Final = {
    "record": run_record,
    "show": run_show,
    "check": run_check,
    "convert": run_convert,
}
