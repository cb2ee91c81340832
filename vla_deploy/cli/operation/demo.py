"""`vla-deploy demo`: the main job on the twin, from a spoken command to a cup in a box.

A synthetic voice says the command in the twin's room; the robot hears, plans and acts, every step
is printed, and physics judges. A robot that understands no speech gets the command as text.
"""

import argparse
import json
import logging
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.aloud import (
    DEFAULT_VOICE,
    HeardLine,
    MotionWatch,
    SpokenCommand,
    wait_until_listening,
)
from vla_deploy.cli.operation.run import add_robot_arguments, add_twin_arguments, run_options
from vla_deploy.cli.operation.say import line_of
from vla_deploy.cli.session import RobotSession
from vla_deploy.cli.twin import SteppingClock, ask_referee
from vla_deploy.client.action_words import action_words
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import ProcessTable
from vla_deploy.ipc.payloads.tasks import TaskEvent
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor

EXAMPLES = """  vla-deploy demo
  vla-deploy demo --seed 7 --json
  vla-deploy demo --command "put the blue ball in the box" --voice en-us+f4 --snr 10
  vla-deploy demo --typed --fast
  vla-deploy demo --robot so101           an arm on a table: a red block into a bowl
  vla-deploy demo --viewer                the twin in a window
"""
SETTLE_S = 1.0
ARM_TIMEOUT_S = 20.0


def register(commands: Any) -> None:
    """Add the command."""
    demo = add_top_command(
        commands, "demo", EXAMPLES, run, json_help="print only the outcome, as JSON"
    )
    add_robot_arguments(demo)
    add_twin_arguments(
        demo,
        twin="as always: the demo is of the twin",
        headless="make no film and open no window, whatever there is",
    )
    demo.add_argument("--command", dest="order", help="what to say (default: the robot file's)")
    demo.add_argument("--voice", default=DEFAULT_VOICE, help="who says it, a voice of eSpeak NG")
    demo.add_argument("--snr", type=float, metavar="DB", help="over noise, this much louder")
    demo.add_argument("--typed", action="store_true", help="give the command as text, say nothing")
    demo.add_argument("--out", type=Path, default=Path("out"), help="folder for film and outcome")


def run(arguments: argparse.Namespace) -> int:
    """Do the job; exit code 0 only if MuJoCo's own state agrees.

    Raises:
        CommandFailed: the job failed.
        UsageError: the command was refused.
    """
    options = run_options(arguments, twin=True, arm=True)
    _make_folder(arguments.out)
    log = logging.NullHandler() if arguments.json else logging.StreamHandler(sys.stdout)
    log.setLevel(logging.WARNING)  # of the handler: the run's log takes more
    logging.basicConfig(handlers=[log], format="%(message)s")
    outcome = Demo(arguments, options).run()
    path = arguments.out / "outcome.json"
    path.write_text(json.dumps(outcome, indent=2) + "\n", encoding="utf-8")
    print(json.dumps(outcome, indent=2) if arguments.json else _summary(outcome, path))
    if outcome["refused"]:
        raise UsageError(outcome["refused"])
    if not outcome["success"]:
        raise CommandFailed(outcome["error"] or "MuJoCo does not agree that the job is done")
    return 0


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"--out {path}: {error.strerror}; choose another folder") from error


class Demo:
    """Run one command on a fresh twin and judge it."""

    def __init__(self, arguments: argparse.Namespace, options: RunOptions) -> None:
        self._arguments = arguments
        self._options = options
        self._plan: dict[str, Any] = {"actions": []}
        self._last: dict[str, Any] = {}
        self._spoken: SpokenCommand | None = None
        self._why_typed = "asked for by --typed" if arguments.typed else ""

    def run(self) -> dict[str, Any]:
        """Start everything, give the command, follow it, ask the referee, stop everything."""
        if refusal := load_robot(self._options.robot).never_moves:
            raise UsageError(refusal)
        self._print(f"starting the twin of {self._options.robot} (seed {self._options.seed})")
        self._order = self._arguments.order or load_robot(self._options.robot).twin.demo
        with Supervisor(self._options) as supervisor:
            supervisor.start()
            clock = SteppingClock(supervisor)
            session = RobotSession(supervisor.run_dir, clock)
            self._wait_armed(session)
            ask_referee(session, "hazards", begin="yes")
            film = self._start_film(session)
            started_ns, started_s = clock.now_ns(), time.monotonic()
            self._follow(self._give_command(session, clock), session)
            took_s, wall_s = (clock.now_ns() - started_ns) / NS_PER_S, time.monotonic() - started_s
            seen = self._control_counters(session)
            session.pause(SETTLE_S)
            judged = self._judge(session)
            seen["pushes"] = _pushes(session)
            film_files = self._stop_film(session) if film else {}
            table = session.document(topics.PROCESS_TABLE)
        return self._outcome(took_s, wall_s, judged, film_files, table) | seen

    def _wait_armed(self, session: RobotSession) -> None:
        def is_armed() -> bool | None:
            status = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
            return (status is not None and status["state"] == "armed") or None

        if not session.wait_for(is_armed, ARM_TIMEOUT_S, 0.1):
            status = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
            raise CommandFailed(f"the robot did not arm within {ARM_TIMEOUT_S:g} s: {status}")

    def _give_command(
        self, session: RobotSession, clock: SteppingClock
    ) -> Iterator[TaskEvent | HeardLine]:
        """Return the events of the command: spoken, or as text where no speech is understood."""
        order = self._order
        self._why_typed = self._why_typed or wait_until_listening(session)
        if self._why_typed:
            self._print(f'command as text: "{order}" (not spoken: {self._why_typed})')
            return session.command(text=order)
        motion = MotionWatch(session)
        clock.meanwhile = motion.look
        self._spoken = spoken = SpokenCommand(session, motion)
        self._print(f'a voice says: "{order}"')
        return spoken.events(order, self._arguments.voice, self._arguments.snr)

    def _follow(self, events: Iterator[TaskEvent | HeardLine], session: RobotSession) -> None:
        for event in events:
            self._last = {**event}
            if event["event"] == "plan":
                self._plan = event["plan"]
            line = event["text"] if event["event"] == "heard" else line_of(event)
            if line:
                self._print(line)
            if event["event"] == "action" and event["status"] == "active":
                self._film_op(
                    session, "caption", text=action_words(event["skill"], event["parameters"])
                )

    def _judge(self, session: RobotSession) -> dict[str, Any]:
        """Ask the referee where the plan's object ended, when it was to end in a box."""
        pair = _object_and_container(self._plan)
        if pair is None:
            return {"judged_by": "actions", "inside": None, "placement_error_m": None}
        answer = ask_referee(session, "inside", object=pair[0], container=pair[1])
        return {"judged_by": "mujoco", **answer}

    def _control_counters(self, session: RobotSession) -> dict[str, Any]:
        """Return control's counters, and a digest of all bytes on its buses."""
        status = session.document(topics.CONTROL_STATUS)
        buses = {} if status is None else status["buses"]
        return {
            "ticks": status and status["tick"],
            "late_ticks": status and status["late_ticks"],
            "bus_timeouts": sum(bus.get("timeouts", 0) for bus in buses.values()),
            "wire_digest": ask_referee(session, "truth")["wire_digest"],
        }

    def _start_film(self, session: RobotSession) -> bool:
        if self._arguments.headless:
            return False
        path = (self._arguments.out / "demo.webm").resolve()
        return self._film_op(session, "film_start", path=str(path)) is not None

    def _stop_film(self, session: RobotSession) -> dict[str, Any]:
        files = self._film_op(session, "film_stop") or {}
        if files.get("film") and os.environ.get("DISPLAY") and shutil.which("xdg-open"):
            subprocess.Popen(["xdg-open", files["film"]], stderr=subprocess.DEVNULL)
        return files

    def _film_op(self, session: RobotSession, op: str, **details: str) -> dict[str, Any] | None:
        """Send a request about the film; a film that fails must not fail the job."""
        if self._arguments.headless:
            return None
        try:
            return ask_referee(session, op, **details)
        except CommandFailed as error:
            self._print(f"no film: {error}")
            return None

    def _outcome(
        self,
        took_s: float,
        wall_s: float,
        judged: dict[str, Any],
        film_files: dict[str, Any],
        table: ProcessTable | None,
    ) -> dict[str, Any]:
        refused = self._last["reason"] if self._last.get("event") == "rejected" else None
        acted = bool(self._last.get("success"))
        success = acted and (judged["judged_by"] == "actions" or bool(judged["inside"]))
        error = self._last.get("error")
        if acted and not success:
            error = "the robot reports success, but MuJoCo does not see the object in the container"
        rows = [] if table is None else table["processes"]
        processes = {row["name"]: row["cpu_ratio"] for row in rows}
        return {
            "success": success,
            "refused": refused,
            "error": error,
            "took_s": round(took_s, 2),
            "wall_s": round(wall_s, 2),
            "seed": self._options.seed,
            "command": self._order,
            "spoken": self._spoken.document() if self._spoken else None,
            "why_typed": self._why_typed or None,
            "actions": self._last.get("actions", []),
            "placement_error_m": judged["placement_error_m"],
            "judged_by": judged["judged_by"],
            "film": film_files,
            "peak_memory_mb": table and table["peak_memory_mb"],
            "memory_kind": table and table["memory_kind"],
            "cpu_ratio": processes,
        }

    def _print(self, line: str) -> None:
        if not self._arguments.json:
            print(line, flush=True)


def _object_and_container(plan: dict[str, Any]) -> tuple[str, str] | None:
    """Return the world's names of what a plan picks and the container it goes into, if any."""
    picked = None
    for action in plan["actions"]:
        given = action["parameters"]
        if action["skill"] == "pick_up":
            picked = str(parse_object(given["object"])).replace(" ", "_")
        if action["skill"] == "place" and given["relation"] == "in" and picked:
            return picked, parse_object(given["destination"]).kind
    return None


def _pushes(session: RobotSession) -> int:
    """Return how many pairs of parts the physics saw pushing too hard."""
    found = ask_referee(session, "hazards", begin="")["hazards"]
    return sum(one["kind"] == "push" for one in found)


def _summary(outcome: dict[str, Any], path: Path) -> str:
    shares = ", ".join(
        f"{name} {100 * share:.0f} %"
        for name, share in outcome["cpu_ratio"].items()
        if share is not None
    )
    error_m = outcome["placement_error_m"]
    placed = "" if error_m is None else f", {1000 * error_m:.0f} mm from the middle"
    lines = [
        f"{'success' if outcome['success'] else 'failed'} after {outcome['took_s']:.1f} s, "
        f"{outcome['wall_s']:.1f} s by the wall clock (judged by {outcome['judged_by']}{placed})",
        *_spoken_lines(outcome["spoken"]),
        f"peak memory of all processes: {outcome['peak_memory_mb']} MB "
        f"({outcome['memory_kind']}); share of a core: {shares}",
        *(f"{name}: {file}" for name, file in outcome["film"].items()),
        f"outcome: {path}",
    ]
    return "\n".join(lines)


def _spoken_lines(spoken: dict[str, Any] | None) -> list[str]:
    if spoken is None:
        return []
    took = [
        f"{name} {spoken[key]:.2f} s"
        for name, key in (
            ("text", "end_to_text_s"),
            ("plan", "end_to_plan_s"),
            ("first motion", "end_to_motion_s"),
        )
        if spoken[key] is not None
    ]
    return [f"from the end of the words to {', '.join(took)}"]
