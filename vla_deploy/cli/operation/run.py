"""`vla-deploy run`: keep a robot, or its twin, running until Ctrl-C."""

import argparse
import faulthandler
import logging
import os
import sys
from pathlib import Path
from typing import Any

from drivers.twin_page import TwinPace
from vla_deploy.cli.commands import add_top_command, whole_number
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.gateways.parameter_file import with_parameters
from vla_deploy.robots import load_robot
from vla_deploy.runtime.exit_codes import EXIT_DEVICE_ABSENT
from vla_deploy.runtime.logs import journal_stream
from vla_deploy.supervisor.errors import DeviceAbsent, ProcessGivenUp, StartCrashed
from vla_deploy.supervisor.profiles.profile_choice import start_profile
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor

EXAMPLES = """  vla-deploy run --twin                 the robot butler in the flat, armed once ready
  vla-deploy run --twin --seed 7        other places for the objects
  vla-deploy run --twin --viewer        the twin in a window
  vla-deploy run --twin --headless      without a window, as without --viewer
  vla-deploy run --twin --paced         its buses as slow as the real ones
  vla-deploy run --twin --fast          as fast as this computer can
  vla-deploy run --twin --ros           in a ROS 2 graph: see docs/ros.md
  vla-deploy run --robot butler         the real robot; arm it when it is safe: vla-deploy arm
"""

_STDERR = 2
_READ_ONLY = "ready, to be read; in another terminal: vla-deploy joint show"
_READY = 'ready; in another terminal: vla-deploy say "%s"; the page: vla-deploy dashboard'


def register(commands: Any) -> None:
    """Add the command."""
    run = add_top_command(commands, "run", EXAMPLES, main)
    add_robot_arguments(run)
    add_twin_arguments(
        run,
        twin="replace the hardware by the twin",
        headless="open no window, which is what happens without --viewer",
    )
    run.add_argument(
        "--devices-dir",
        type=lambda path: Path(path).resolve(),
        metavar="DIR",
        help="take every device from here: a twin that runs by itself (python -m sim_twin)",
    )
    run.add_argument(
        "--arm",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="arm once everything is ready (default: only with --twin)",
    )
    run.add_argument(
        "--ros", action="store_true", help="run the ROS 2 gateway, whatever the robot file says"
    )
    run.add_argument(
        "--params-file",
        type=Path,
        metavar="FILE",
        help="YAML parameters, as of ROS, that hold for the whole robot: see docs/ros.md",
    )
    run.set_defaults(profile=None)


def add_robot_arguments(command: argparse.ArgumentParser) -> None:
    """Add the arguments that choose robot, profile and world."""
    command.add_argument("--robot", default="butler", help="name or folder (default: butler)")
    command.add_argument(
        "--profile",
        default="desktop",
        help="platform profile (run takes the chosen or detected one)",
    )
    command.add_argument("--world", default="", help="the twin's world (default: the robot file's)")
    command.add_argument("--seed", type=whole_number(0), default=0, help="where the objects lie")


def add_twin_arguments(command: argparse.ArgumentParser, *, twin: str, headless: str) -> None:
    """Add the arguments of the twin; `twin` and `headless` are help texts."""
    command.add_argument("--twin", action="store_true", help=twin)
    window = command.add_mutually_exclusive_group()
    window.add_argument("--viewer", action="store_true", help="show the twin in a window")
    window.add_argument("--headless", action="store_true", help=headless)
    command.add_argument(
        "--paced",
        action="store_true",
        help="give what is on the twin's buses the time it takes on the wire",
    )
    pace = command.add_mutually_exclusive_group()
    pace.add_argument(
        "--fast",
        dest="pace",
        action="store_const",
        const=TwinPace.FAST,
        default=TwinPace.REAL,
        help="run the twin's time as fast as this computer can (default: as the wall clock, "
        "or slower where the robot's processes need longer)",
    )
    pace.add_argument(
        "--wall",
        dest="pace",
        action="store_const",
        const=TwinPace.WALL,
        help="use the wall clock as the twin's time, even if processes are late: for real-time "
        "measurements",
    )


def run_options(arguments: argparse.Namespace, **more: Any) -> RunOptions:
    """Return the options that the arguments of robot and twin give, and `more`."""
    chosen: dict[str, Any] = {
        "robot": arguments.robot,
        "profile": arguments.profile,
        "viewer": arguments.viewer,
        "paced": arguments.paced,
        "pace": arguments.pace,
        "seed": arguments.seed,
        "world": arguments.world,
        "runtime_base": arguments.runtime_base,
    }
    return RunOptions(**(chosen | more))


def main(arguments: argparse.Namespace) -> int:
    """Run until SIGINT or SIGTERM; an absent device has its own exit code, for another try.

    Raises:
        CommandFailed: a process that the robot needs was given up.
    """
    asked = {
        "viewer": arguments.viewer,
        "paced": arguments.paced,
        arguments.pace.value: arguments.pace is not TwinPace.REAL,
    }
    for option in (name for name, is_asked in asked.items() if is_asked and not arguments.twin):
        sys.stderr.write(f"run: --{option} is about the twin; add --twin\n")
        return 2
    if arguments.twin and arguments.devices_dir is not None:
        sys.stderr.write("run: --devices-dir is of a twin that runs by itself; leave out --twin\n")
        return 2
    faulthandler.enable(_STDERR)
    if not journal_stream(os.environ, _STDERR):  # the supervisor logs there itself
        logging.basicConfig(stream=sys.stdout, level=logging.INFO, format="%(message)s")
    arm = arguments.twin if arguments.arm is None else arguments.arm
    profile, fault = arguments.profile, ""
    if profile is None:
        start = start_profile(arguments.runtime_base)
        profile, fault = start.name, start.fault
        logging.info("profile %s: %s", profile, start.why)
    options = run_options(
        arguments,
        profile=profile,
        profile_fault=fault,
        twin=arguments.twin,
        devices_dir=arguments.devices_dir,
        arm=arm,
        ros=arguments.ros,
    )
    options = with_parameters(options, arguments.params_file)
    try:
        _keep_running(options)
    except DeviceAbsent as error:
        sys.stderr.write(f"vla-deploy: {error}\n")
        return EXIT_DEVICE_ABSENT
    except (ProcessGivenUp, StartCrashed) as error:
        raise CommandFailed(str(error)) from error
    print("stopped in order")
    return 0


def _keep_running(options: RunOptions) -> None:
    with Supervisor(options) as supervisor:
        supervisor.start()
        if not supervisor.stop_requested:
            robot = load_robot(options.robot)
            words = _READY % robot.twin.demo
            print(_READ_ONLY if robot.read_only else words, flush=True)
        supervisor.run_until_stopped()
