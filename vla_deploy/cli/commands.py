"""Declare the commands: their table, and what their parsers are built of.

A module is loaded when one of its commands is used: all of them together take a second to load.
"""

import argparse
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, NoReturn

Run = Callable[[argparse.Namespace], int]


@dataclass(frozen=True, slots=True)
class CommandEntry:
    """Name the module that registers a command, and say what the command is for."""

    module: str
    summary: str


COMMANDS: Final[Mapping[str, CommandEntry]] = {
    "run": CommandEntry("operation.run", "run the robot until Ctrl-C"),
    "demo": CommandEntry("operation.demo", "do the main job on the twin"),
    "say": CommandEntry("operation.say", "give the robot a command and follow it"),
    "hear": CommandEntry(
        "observation.hear", "show what is understood of a recording, or of live speech"
    ),
    "plan": CommandEntry(
        "observation.plan", "show the plan for a command, and which back end made it"
    ),
    "status": CommandEntry("observation.status", "show what runs and the state of the robot"),
    "dashboard": CommandEntry(
        "maintenance.dashboard", "show where the robot's page is, and who may use it"
    ),
    "top": CommandEntry(
        "observation.top", "show processes, budgets, control and topics on one screen, for ssh"
    ),
    "metrics": CommandEntry(
        "observation.metrics", "list what is measured; print alert rules or a Grafana dashboard"
    ),
    "scene": CommandEntry(
        "observation.scene", "show what the robot knows about the things around it"
    ),
    "memory": CommandEntry(
        "observation.memory", "show what the robot remembers, correct and delete it"
    ),
    "devices": CommandEntry(
        "observation.devices", "show the devices of the home that the robot switches"
    ),
    "budget": CommandEntry(
        "observation.budget",
        "show what the robot uses of its budgets, and what is done about an excess",
    ),
    "logs": CommandEntry("observation.logs", "show what the processes log"),
    "crashes": CommandEntry("observation.logs", "list and show crash reports"),
    "estop": CommandEntry(
        "operation.operate", "stop the robot now and latch the stop (a software stop)"
    ),
    "reset": CommandEntry(
        "operation.operate", "release a latched stop; nothing moves, arm the robot next"
    ),
    "arm": CommandEntry(
        "operation.operate",
        "put power on the joints where they are, so that commands may move them",
    ),
    "disarm": CommandEntry("operation.operate", "take power off the joints"),
    "stop": CommandEntry("operation.operate", "stop what the robot does; it stays ready"),
    "pause": CommandEntry("operation.operate", "have the robot come to rest where it is"),
    "resume": CommandEntry("operation.operate", "have the robot go on with what was paused"),
    "shutdown": CommandEntry(
        "operation.operate",
        "end the run in order, as Ctrl-C does; power goes off, so support the arms",
    ),
    "mission": CommandEntry(
        "operation.mission", "give a mission of several objectives, and see how far it is"
    ),
    "agent": CommandEntry(
        "operation.agent", "lease the robot to AI agents for a while, and take the lease back"
    ),
    "mcp": CommandEntry(
        "operation.mcp", "serve AI agents by the Model Context Protocol; started by the agent"
    ),
    "joint": CommandEntry(
        "operation.joint", "show where the joints are, move one, replay an episode"
    ),
    "teleoperate": CommandEntry(
        "operation.teleoperate", "move the arm by hand: by a leader arm, by keys, by a gamepad"
    ),
    "profile": CommandEntry("maintenance.profile", "choose how the stack uses this computer"),
    "robot": CommandEntry("devices.robot", "write the robot's description as URDF, for ROS"),
    "servo": CommandEntry("devices.servo", "find, look at, set up and calibrate servos"),
    "camera": CommandEntry(
        "devices.camera", "calibrate the camera: its lens, and how it sits on the head"
    ),
    "can": CommandEntry("devices.can", "find CAN nodes and watch the traffic"),
    "fault": CommandEntry("devices.fault", "make the twin's devices fail"),
    "person": CommandEntry("devices.person", "take and put down things in the twin's world"),
    "flight": CommandEntry("recording.flight", "show what the flight recorder saved"),
    "record": CommandEntry(
        "recording.record", "record what the robot does: rolling files, or one of your own"
    ),
    "replay": CommandEntry(
        "recording.replay", "replay a recording or a flight on the dashboard; no robot"
    ),
    "foxglove": CommandEntry(
        "recording.viewers", "serve the run live to viewers such as Foxglove, read-only"
    ),
    "rerun": CommandEntry(
        "recording.viewers", "show a recording, a flight or the live run in Rerun"
    ),
    "check": CommandEntry(
        "maintenance.check", "check a robot, a profile or a plan, and report all faults"
    ),
    "schema": CommandEntry(
        "maintenance.check", "print the JSON Schema of a plan or of an analysis"
    ),
    "map": CommandEntry(
        "maintenance.map", "record, look at, check and convert maps in the ROS format"
    ),
    "models": CommandEntry(
        "models.commands", "add, fetch, list, measure, quantise and verify models"
    ),
    "analyse": CommandEntry(
        "observation.analyse", "analyse the scene, and whether a goal can be reached"
    ),
    "servers": CommandEntry(
        "models.servers", "see and try the model servers that the robot may ask"
    ),
    "doctor": CommandEntry(
        "maintenance.doctor", "examine this computer, and say how to repair what is wrong"
    ),
    "probes": CommandEntry(
        "maintenance.doctor", "print load, memory, power, heat and throttling of this computer"
    ),
    "bench": CommandEntry(
        "maintenance.measure", "measure against a peer or a limit, in the same run"
    ),
    "validate": CommandEntry("maintenance.measure", "run a campaign against the twin"),
    "install": CommandEntry(
        "maintenance.install", "install the robot as a service of this computer"
    ),
    "uninstall": CommandEntry("maintenance.install", "remove exactly what install wrote"),
    "release": CommandEntry("maintenance.release", "add releases, switch between them, go back"),
}


class OneLineParser(argparse.ArgumentParser):
    """Report a bad argument in one line; the parsers of subcommands do the same."""

    def error(self, message: str) -> NoReturn:
        """Exit with code 2."""
        self.exit(2, f"{self.prog}: {message}; see: {self.prog} --help\n")


def add_command(
    commands: Any,
    name: str,
    summary: str,
    examples: str,
    run: Run | None = None,
    json_help: str = "",
) -> argparse.ArgumentParser:
    """Add a command that `run` carries out and whose `--help` ends with examples.

    `json_help` is the help text of its option `--json`; without one it has no such option.
    """
    added: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"examples:\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    if json_help:
        added.add_argument("--json", action="store_true", help=json_help)
    if run is not None:
        added.set_defaults(run=run)
    return added


def add_top_command(
    commands: Any, name: str, examples: str, run: Run | None = None, json_help: str = ""
) -> argparse.ArgumentParser:
    """Add a command of the table `COMMANDS`, which has its summary."""
    return add_command(commands, name, COMMANDS[name].summary, examples, run, json_help)


def number_within(low: float, high: float, expected: str) -> Callable[[str], float]:
    """Return an argparse `type` for finite numbers from `low` to `high`, both included.

    `expected` names the range in the error message.
    """
    return _number_type(lambda value: low <= value <= high, expected)


def number_above_zero(what: str) -> Callable[[str], float]:
    """Return an argparse `type` for finite numbers above 0; `what` names the quantity."""
    return _number_type(lambda value: 0.0 < value < math.inf, f"{what} above 0")


def _number_type(is_valid: Callable[[float], bool], expected: str) -> Callable[[str], float]:
    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not is_valid(value):
            raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}")
        return value

    return parse


def whole_number(low: int = 1) -> Callable[[str], int]:
    """Return an argparse `type` for whole numbers from `low`."""

    def parse(text: str) -> int:
        if not text.isdecimal() or int(text) < low:
            raise argparse.ArgumentTypeError(f"expected a whole number from {low}, got {text!r}")
        return int(text)

    return parse


def emit(
    arguments: argparse.Namespace,
    document: object,
    text: str | Callable[[], str],
    indent: int | None = 2,
) -> int:
    """Print a result, as JSON where `--json` is given; return exit code 0.

    A text that is composed from another process's document is passed as a function: whatever is
    wrong with it, the document itself can be printed.
    """
    if arguments.json:
        print(json.dumps(document, indent=indent))
        return 0
    text = text if isinstance(text, str) else text()
    if text:
        print(text)
    return 0
