"""Start the twin: `python -m sim_twin --robot butler --world flat --seed 0 --run-dir D`."""

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from drivers.clock import MonotonicClock
from drivers.errors import DriverError
from drivers.twin_page import TwinPace
from sim_twin.errors import TwinError
from sim_twin.lifetime import die_with_parent
from sim_twin.process import TwinOptions, TwinProcess
from vla_deploy.robots import RobotFileError

_EXAMPLE = """example:
  python -m sim_twin --robot butler --world flat --seed 0 --run-dir /tmp/run
Devices appear under RUN_DIR/dev; the file RUN_DIR/dev/ready says that all are served."""


def main(argv: Sequence[str] | None = None) -> int:
    """Serve a twin until SIGTERM or SIGINT, or the end of the parent that asked for it."""
    options = _parser().parse_args(argv)
    stop = [False]

    def request_stop(_number: int, _frame: object) -> None:
        stop[0] = True

    signal.signal(signal.SIGTERM, request_stop)
    signal.signal(signal.SIGINT, request_stop)
    # A twin that a shell started in the background goes on when that shell ends.
    if options.parent_pid is not None:
        die_with_parent(options.parent_pid)
    try:
        process = TwinProcess(_twin_options(options), MonotonicClock())
    except (TwinError, DriverError, RobotFileError, OSError) as error:
        sys.stderr.write(f"twin: {error}\n")
        return 2
    try:
        process.run(lambda: stop[0])
    finally:
        process.close()
    return 0


def _twin_options(options: argparse.Namespace) -> TwinOptions:
    return TwinOptions(
        robot=options.robot,
        world=options.world,
        seed=options.seed,
        run_dir=options.run_dir,
        camera=not options.no_camera,
        viewer=options.viewer,
        paced=options.paced,
        pace=options.pace,
        hold_for_pid=options.hold_for,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sim_twin",
        description="Serve a robot's devices from a simulation.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--robot", default="butler", help="robot name (default: butler)")
    parser.add_argument("--world", default="", help="world name (default: the robot file's)")
    parser.add_argument("--seed", type=int, default=0, help="seed of object poses and noise")
    parser.add_argument("--run-dir", type=Path, required=True, help="folder of this run")
    parser.add_argument("--no-camera", action="store_true", help="serve no camera: no OpenGL")
    parser.add_argument("--viewer", action="store_true", help="show the twin in a window")
    parser.add_argument(
        "--paced",
        action="store_true",
        help="let bytes on the servo bus and frames on CAN take their time, at the robot's rates",
    )
    parser.add_argument(
        "--pace",
        type=TwinPace,
        choices=list(TwinPace),
        default=TwinPace.WALL,
        help="real, fast: the processes of the run in RUN_DIR are waited for; default: wall",
    )
    parser.add_argument(
        "--hold-for", type=int, metavar="PID", help="time begins when this process takes part in it"
    )
    parser.add_argument("--parent-pid", type=int, help="end with this process, the parent")
    return parser


if __name__ == "__main__":
    sys.exit(main())
