"""`vla-deploy devices`: what is known of the devices of the home that the robot switches."""

import argparse
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import FRESH_S, attach
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.services import DevicesStatus, DeviceStatus

EXAMPLES: Final = """  vla-deploy devices
  vla-deploy devices --json
  vla-deploy devices --robot butler      # asks the devices themselves; no robot needs to run
"""
_STATES: Final[Mapping[bool | None, str]] = {True: "on", False: "off", None: "unknown"}


def register(commands: Any) -> None:
    """Add the command."""
    devices = add_top_command(commands, "devices", EXAMPLES, run, json_help="print it as JSON")
    devices.add_argument("--robot", metavar="NAME", help="ask this robot's devices, not the run")


def run(arguments: argparse.Namespace) -> int:
    """Print what the run knows of the devices, or what they say themselves."""
    status = _asked(arguments.robot) if arguments.robot else _of_run(arguments)
    return emit(arguments, status, lambda: _table(status))


def _of_run(arguments: argparse.Namespace) -> DevicesStatus:
    status = attach(arguments.runtime_base).document(topics.DEVICE_STATUS, age_limit_s=FRESH_S)
    if status is None:
        raise UsageError("the executor tells nothing of devices; see: vla-deploy status")
    return status


def _asked(robot: str) -> DevicesStatus:
    # Loaded here: it takes a moment that the run's own devices do not.
    from drivers.clock import MonotonicClock
    from vla_deploy.devices import open_home
    from vla_deploy.robots import load_robot
    from vla_deploy.runtime.executors import InlineExecutor

    home = open_home(load_robot(robot), MonotonicClock(), lambda _name: InlineExecutor())
    home.refresh()
    status = home.document()
    home.close()
    return status


def _table(status: DevicesStatus) -> str:
    if not status["devices"]:
        return "the robot file names no devices; see docs/devices.md"
    rows = [f"{'device':<16} {'kind':<8} {'place':<16} {'state':<8} {'age':>8}  reached by"]
    return "\n".join([*rows, *map(_row, status["devices"])])


def _row(device: DeviceStatus) -> str:
    age = "" if device["age_s"] is None else f"{device['age_s']:.1f} s"
    called = f', calls itself "{device["called"]}"' if device["called"] else ""
    reached = device["fault"] or f"{device['where']}{called}"
    return (
        f"{device['name']:<16} {device['kind']:<8} {device['place']:<16} "
        f"{_STATES[device['is_on']]:<8} {age:>8}  {reached}"
    )
