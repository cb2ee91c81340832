"""`vla-deploy map record | show | check | convert`: maps in the ROS format."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import cv2

from vla_deploy.cli.commands import add_command, add_top_command, emit, number_above_zero
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.navigation.maps.map_check import as_characters, check_for_robot, describe
from vla_deploy.robots import load_robot
from vla_deploy.robots.maps.map_file import (
    files_of,
    image_of,
    read_map_file,
    require_free,
    write_map_file,
)

if TYPE_CHECKING:
    from vla_deploy.perception.map_recorder import MapRecorder

EXAMPLES: Final = """  vla-deploy map record maps/home.yaml        drive it around, then Ctrl-C
  vla-deploy map check maps/home.yaml
  vla-deploy map show maps/home.yaml --png home.png
  vla-deploy map convert old.yaml maps/home.yaml
"""
_PROGRESS_EVERY_S: Final = 5.0
_STEP_S: Final = 0.02
_MIN_SCANS: Final = 10


def register(commands: Any) -> None:
    """Add the command."""
    acts = add_top_command(commands, "map", EXAMPLES).add_subparsers(
        dest="act", required=True, metavar="ACT"
    )
    record, show, check, convert = (
        add_command(acts, name, summary, EXAMPLES, run, json_help="print JSON")
        for name, summary, run in (
            ("record", "draw a map while the robot is driven around", run_record),
            ("show", "draw a map in the terminal, or into a PNG", run_show),
            ("check", "show what a map holds and whether it fits", run_check),
            ("convert", "write a map of any mode and image as a trinary PGM", run_convert),
        )
    )
    record.add_argument("map", type=Path, help="the YAML file to write; its image goes next to it")
    record.add_argument("--robot", default="butler", help="name or folder (default: butler)")
    record.add_argument(
        "--seconds",
        type=number_above_zero("seconds"),
        default=math.inf,
        help="end then (default: at Ctrl-C)",
    )
    record.add_argument(
        "--resolution",
        type=number_above_zero("metres"),
        default=0.05,
        help="of a cell (0.05 m)",
    )
    show.add_argument("--png", type=Path, metavar="FILE", help="write an image instead")
    check.add_argument(
        "--robot", help="name or folder: check that it fits there and reaches its places"
    )
    for act in (show, check, convert):
        act.add_argument("map", type=Path, help="its YAML file")
    convert.add_argument("to", type=Path, help="the YAML file to write; its image goes next to it")
    for act in (record, convert):
        act.add_argument("--replace", action="store_true", help="replace a map of that name")


def run_record(arguments: argparse.Namespace) -> int:
    """Draw a map until Ctrl-C, then write it."""
    from vla_deploy.perception.map_recorder import MapRecorder  # loads pinocchio

    if not arguments.replace:
        require_free(arguments.map)
    session = attach(arguments.runtime_base)
    recorder = MapRecorder(load_robot(arguments.robot), session.space, arguments.resolution)
    if not arguments.json:
        frame = "of the present map" if recorder.on_old_frame else "that begins here"
        print(f"recording in the frame {frame}; drive slowly through every room, then Ctrl-C")
    _record(session, recorder, arguments)
    session.close()
    mapper = recorder.mapper
    if mapper.scans < _MIN_SCANS:
        raise CommandFailed(
            f"only {mapper.scans} scans came in {arguments.seconds:g} s, so there is no map; "
            "does the lidar run? vla-deploy status"
        )
    file = mapper.grid.map_file()
    write_map_file(arguments.map, file, comment="Recorded by `vla-deploy map record`.")
    counts = {"scans": mapper.scans, "refused_scans": mapper.refused}
    return _emit(arguments, describe(file) | counts | {"map": str(arguments.map)})


def _record(session: RobotSession, recorder: "MapRecorder", arguments: argparse.Namespace) -> None:
    """Step the recorder until the time is over or Ctrl-C."""
    steps, mapper = 0, recorder.mapper
    try:
        while steps * _STEP_S < arguments.seconds:
            recorder.step()
            session.pause(_STEP_S)
            steps += 1
            if not arguments.json and steps % round(_PROGRESS_EVERY_S / _STEP_S) == 0:
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
        return _emit(arguments, {"png": str(arguments.png)})
    _emit(arguments, describe(file))
    if not arguments.json:
        print(as_characters(file))
    return 0


def run_check(arguments: argparse.Namespace) -> int:
    """Print what a map holds; return 1 where the robot cannot use it."""
    file = read_map_file(arguments.map)
    report: dict[str, Any] = describe(file)
    faults: list[str] = []
    if arguments.robot is not None:
        more, faults = check_for_robot(file, load_robot(arguments.robot))
        report |= more
    _emit(arguments, report | {"faults": faults})
    return 1 if faults else 0


def run_convert(arguments: argparse.Namespace) -> int:
    """Write a map as trinary, not negated, with a PGM image."""
    written = {one.resolve() for one in files_of(arguments.to)}
    if arguments.map.resolve() in written or image_of(arguments.map).resolve() in written:
        raise UsageError(f"{arguments.to}: choose another file, the map itself is kept")
    if not arguments.replace:
        require_free(arguments.to)
    write_map_file(arguments.to, read_map_file(arguments.map).as_trinary())
    return _emit(arguments, {"map": str(arguments.to)})


def _emit(arguments: argparse.Namespace, report: dict[str, Any]) -> int:
    lines = [f"{name}: {value}" for name, value in report.items() if name != "faults"]
    return emit(arguments, report, "\n".join([*lines, *report.get("faults", ())]))
