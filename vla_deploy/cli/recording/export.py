"""`vla-deploy record export`: write recordings in the format of other software."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.commands import add_command, emit, whole_number
from vla_deploy.cli.recording.runs import find_recorded
from vla_deploy.cli.session import base_of
from vla_deploy.telemetry.recorded_file import read_file

FORMATS: Final = ("lerobot",)
USUAL_FPS: Final = 25
"""As often as the recorder reads the joints."""
UNITS: Final = ("degrees", "range")
UNIT_HELP: Final = (
    "of joints that are no gripper: degrees from the middle of the range, as LeRobot's arms have "
    "it now, or range, -100 to 100 (default: degrees)"
)
_EXAMPLES: Final = """\
  vla-deploy record export latest -o pick_cube
  vla-deploy record export monday.mcap tuesday.mcap -o pick_cube --fps 20
  vla-deploy record export run.mcap -o waving --task "wave at me" --without-images
"""


def register(acts: Any) -> None:
    """Add the command."""
    summary = "write recordings as a LeRobot dataset, an episode for each command in words"
    export = add_command(acts, "export", summary, _EXAMPLES, run, json_help="print it as JSON")
    export.add_argument("files", nargs="+", help="files, numbers of recordings, or: latest")
    export.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FOLDER", help="a folder to make"
    )
    export.add_argument("--format", choices=FORMATS, default=FORMATS[0], help="(default: lerobot)")
    export.add_argument(
        "--fps", type=whole_number(), default=USUAL_FPS, help=f"frames a second ({USUAL_FPS})"
    )
    export.add_argument("--unit", choices=UNITS, default=UNITS[0], help=UNIT_HELP)
    export.add_argument(
        "--task", metavar="WORDS", help="each recording is one episode, in which this was done"
    )
    export.add_argument("--with-failed", action="store_true", help="take commands that failed, too")
    export.add_argument("--without-images", action="store_true", help="leave the cameras out")
    export.add_argument("--robot", help="the robot's folder (default: as the recordings say)")


def run(arguments: argparse.Namespace) -> int:
    """Write the dataset; it appears when it is whole.

    Raises:
        DatasetRefused: there is nothing to write, or it does not fit together.
        ExtraMissing: the extra `lerobot` is not installed.
    """
    # They load NumPy and OpenCV.
    from vla_deploy.robots.calibration.lerobot_units import LeRobotUnit
    from vla_deploy.telemetry.lerobot.export import DatasetRequest, export

    base = base_of(arguments)
    written = export(
        [read_file(find_recorded(base, name)) for name in arguments.files],
        arguments.output,
        DatasetRequest(
            fps=arguments.fps,
            unit=LeRobotUnit(arguments.unit),
            task=arguments.task,
            with_failed=arguments.with_failed,
            with_images=not arguments.without_images,
            robot=arguments.robot,
        ),
    )
    cameras = ", ".join(written.cameras) or "no camera"
    text = f"{arguments.output}: {written.episodes} episodes, {written.frames} frames, {cameras}"
    return emit(arguments, {"folder": str(arguments.output), **asdict(written)}, text)
