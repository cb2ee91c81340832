"""List the commands: which module has each, and what it is for.

A module is loaded when one of its commands is used: all of them together take a second to load.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Command:
    """Name the module that registers a command, and say what the command is for."""

    module: str
    summary: str


COMMANDS: Final[Mapping[str, Command]] = {
    "run": Command("run", "run the robot until Ctrl-C"),
    "demo": Command("demo", "do the main job on the twin"),
    "say": Command("say", "give the robot a command and follow it"),
    "hear": Command("hear", "tell what is understood of a recording, or of what you say now"),
    "plan": Command("plan", "tell what would be done for a command, and who planned it"),
    "status": Command("status", "tell what runs and how the robot is"),
    "dashboard": Command("dashboard", "tell where the robot's page is, and who may use it"),
    "top": Command("top", "show processes, budgets, control and topics on one screen, for ssh"),
    "metrics": Command(
        "metrics", "list what is measured; print alert rules or a Grafana dashboard"
    ),
    "scene": Command("scene", "tell what the robot knows of the things around it"),
    "memory": Command("memory", "tell what the robot remembers, and have it forget"),
    "budget": Command(
        "budget", "tell what the robot uses of its budgets, and what is done about an excess"
    ),
    "logs": Command("logs", "show what the processes log"),
    "crashes": Command("crashes", "list and show crash reports"),
    "estop": Command("operate", "stop the robot now and latch the stop (a software stop)"),
    "reset": Command("operate", "release a latched stop; nothing moves, arm the robot next"),
    "arm": Command(
        "operate", "put power on the joints where they are, so that commands may move them"
    ),
    "disarm": Command("operate", "take power off the joints"),
    "stop": Command("operate", "stop what the robot does; it stays ready"),
    "shutdown": Command(
        "operate", "end the run in order, as Ctrl-C does; power goes off, so support the arms"
    ),
    "joint": Command("joint", "show where the joints are, and move one of them"),
    "profile": Command("profile", "choose how the stack uses this computer"),
    "robot": Command("robot", "write the robot's description as URDF, for ROS"),
    "servo": Command("servo", "find, look at, set up and calibrate servos"),
    "camera": Command("camera", "calibrate the camera: its lens, and how it sits on the head"),
    "can": Command("can", "find CAN nodes and watch the traffic"),
    "fault": Command("fault", "make the twin's devices fail"),
    "flight": Command("flight", "look into what the flight recorder saved"),
    "record": Command("record", "record what the robot does: rolling files, or one of your own"),
    "replay": Command("replay", "show a recording or a flight as if it were happening; no robot"),
    "foxglove": Command("foxglove", "let viewers such as Foxglove watch the run live, read-only"),
    "rerun": Command("rerun", "look at a recording, a flight or the run live in Rerun"),
    "check": Command("check", "check a robot, a profile or a plan, and report all faults"),
    "schema": Command("check", "print the JSON Schema of a plan or of an analysis"),
    "map": Command("map", "record, look at, check and convert maps in the ROS format"),
    "models": Command("models", "add, fetch, list, measure, quantise and verify models"),
    "analyse": Command("analyse", "tell what the scene holds, and whether a goal can be reached"),
    "servers": Command("servers", "see and try the model servers that the robot may ask"),
    "doctor": Command("doctor", "examine this computer, and say how to mend what is wrong"),
    "probes": Command("doctor", "print load, memory, power, heat and throttling of this computer"),
    "bench": Command("bench", "measure beside a peer or a limit, in the same run"),
    "validate": Command("validate", "run a campaign against the twin"),
    "install": Command("install", "install the robot as a service of this computer"),
    "uninstall": Command("install", "remove exactly what install wrote"),
    "release": Command("release", "add releases, switch between them, go back"),
}
