"""`vla-deploy top`: processes, budgets, control and topics on one screen, for use over ssh.

The numbers come from shared memory, not from the dashboard. The screen is laid out for 80 by 24
characters, and its words say everything that its colours say.
"""

import argparse
import contextlib
import json
import os
import select
import sys
import termios
import tty
from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from vla_deploy.cli.commands import add_top_command, number_within
from vla_deploy.cli.observation.status import twin_words
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.cli.terminal import plain
from vla_deploy.client.battery import battery_words
from vla_deploy.client.escaping import escaped_document
from vla_deploy.ipc import TOPICS, PulseReader

DOCUMENTS: Final = (
    "process_table",
    "activity",
    "control_status",
    "budget",
    "executor_status",
    "planner_status",
    "board",
    "twin_status",
    "battery",
)
AGE_LIMIT_S: Final = 3.0
_LONGEST_S: Final = 3600.0
_BAD: Final = "bold red"
_POOR: Final = "yellow"
_STATE_STYLES: Final = {"armed": "green", "disarmed": "", "protective_stop": _POOR}
_LATE_TOPICS: Final = 3
Report = Mapping[str, Any]
_EXAMPLES: Final = "  vla-deploy top\n  vla-deploy top --once\n  vla-deploy top --once --json\n"


def register(commands: Any) -> None:
    """Add the command."""
    top = add_top_command(
        commands, "top", _EXAMPLES, run, json_help="print it as JSON, one object a line"
    )
    top.add_argument("--once", action="store_true", help="show it once, and end")
    top.add_argument(
        "--every",
        type=number_within(0.1, _LONGEST_S, f"0.1 to {_LONGEST_S:g} s"),
        default=1.0,
        metavar="S",
        help="seconds (default 1)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Show the run on this machine until `q` or Ctrl-C."""
    reader = TopReader(attach(arguments.runtime_base))
    if arguments.json:
        return _print_json(reader, arguments)
    console = Console(file=plain(sys.stdout))
    if arguments.once or not console.is_terminal:
        console.print(screen(reader.read()), soft_wrap=False)
        return 0
    return _follow(reader, console, arguments.every)


class TopReader:
    """Read what the screen shows from the topics."""

    def __init__(self, session: RobotSession) -> None:
        self.session = session
        self._pulses: dict[str, PulseReader] = {
            topic.name: session.space.pulse_reader(topic.name) for topic in TOPICS
        }

    def read(self) -> dict[str, Any]:
        """Return the documents, None where a process is silent, and the topics that are late."""
        documents = {
            name: escaped_document(self.session.document(name, AGE_LIMIT_S)) for name in DOCUMENTS
        }
        return {**documents, **self._topics(self.session.clock.now_ns())}

    def _topics(self, now_ns: int) -> dict[str, Any]:
        pulses = {name: reader.latest() for name, reader in self._pulses.items()}
        written = {name: pulse for name, pulse in pulses.items() if pulse is not None}
        late = [
            {"topic": topic.name, "age_s": age_s, "deadline_s": topic.deadline_s}
            for topic in TOPICS
            if topic.name in written and topic.deadline_s
            if (age_s := written[topic.name].age_s(now_ns)) > 2 * topic.deadline_s
        ]
        return {"topics": len(written), "late_topics": late}


def _print_json(reader: TopReader, arguments: argparse.Namespace) -> int:
    while True:
        print(json.dumps(reader.read()), flush=True)
        if arguments.once:
            return 0
        reader.session.pause(arguments.every)


def _follow(reader: TopReader, console: Console, every_s: float) -> int:
    if console.is_dumb_terminal:
        while True:
            console.print(screen(reader.read()), soft_wrap=False)
            reader.session.pause(every_s)
    with _keys() as pressed, Live(console=console, screen=True, auto_refresh=False) as live:
        while True:
            live.update(screen(reader.read()), refresh=True)
            if pressed(every_s) == "q":
                return 0


@contextlib.contextmanager
def _keys() -> Iterator[Any]:
    """Yield a function that waits for a key, and restore the terminal afterwards."""
    if not sys.stdin.isatty():
        yield lambda seconds: select.select([], [], [], seconds) and ""
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield lambda seconds: _key(descriptor, seconds)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _key(descriptor: int, seconds: float) -> str:
    ready, _, _ = select.select([descriptor], [], [], seconds)
    return os.read(descriptor, 1).decode(errors="replace") if ready else ""


def screen(report: Report) -> RenderableType:
    """Return the whole screen; what is silent says so."""
    return Group(
        _head(report),
        _safety(report),
        _work(report),
        _processes(report),
        _ticks(report),
        *_below(report),
    )


def _head(report: Report) -> Text:
    table = report["process_table"]
    if table is None:
        return Text("the supervisor is silent", style=_BAD)
    pace = report["twin_status"]
    how_fast = f" {twin_words(pace)}" if pace else ""
    twin = f", twin{how_fast}" if table["twin"] else ""
    refusal = f"  NO COMMANDS: {table['refusal']}" if table["refusal"] else ""
    words = Text(f"{table['robot']} on {table['profile']}{twin}", style="bold")
    return words.append(refusal, style=_BAD)


def _safety(report: Report) -> Text:
    control = report["control_status"]
    if control is None:
        return Text("safety: control is silent", style=_BAD)
    words = Text("safety: ").append(
        control["state"], style=_STATE_STYLES.get(control["state"], _BAD)
    )
    if control["estop_latched"]:
        words.append(", EMERGENCY STOP LATCHED", style=_BAD)
    if control["cause"]:
        words.append(f", {control['cause']} {control['subject']}{_measured(control)}", _POOR)
    return words


def _measured(control: Report) -> str:
    if control["measured"] is None or control["limit"] is None:
        return ""
    age = f", {control['age_s']:.2f} s ago" if control["age_s"] is not None else ""
    return f" ({control['measured']:g}, limit {control['limit']:g}{age})"


def _work(report: Report) -> Text:
    executor, planner = report["executor_status"], report["planner_status"]
    activity = report["activity"]["activity"] if report["activity"] else "unknown"
    if executor is None:
        return Text(f"{activity}: the executor is silent", style=_POOR)
    doing = f"{executor['skill']} of {executor['command_id']}" if executor["skill"] else "nothing"
    waiting = len(planner["commands"]) if planner else 0
    asks = f"; asks: {planner['question']}" if planner and planner["question"] else ""
    return Text(f"{activity}: {doing}; {waiting} being planned{asks}")


def _processes(report: Report) -> RenderableType:
    grid = Table(box=None, padding=(0, 1), pad_edge=False)
    for name in ("process", "state", "restarts", "cores", "of", "MB", "of"):
        grid.add_column(name, justify="left" if name in ("process", "state") else "right")
    limits = _budgets(report["budget"])
    for row in report["process_table"]["processes"] if report["process_table"] else ():
        cpu, memory = limits.get((row["name"], "cpu_ratio")), limits.get((row["name"], "memory_mb"))
        style = "" if row["state"] in ("ready", "off") and not row["alarms"] else _POOR
        grid.add_row(
            Text(row["name"], style),
            Text(row["state"] + (" !" if row["alarms"] else ""), style),
            str(row["restarts"]),
            *_used(cpu, row["cpu_ratio"], ".2f"),
            *_used(memory, row["memory_mb"], ".0f"),
        )
    return grid


def _budgets(budget: Report | None) -> dict[tuple[str, str], Report]:
    return {(row["process"], row["metric"]): row for row in budget["rows"]} if budget else {}


def _used(row: Report | None, otherwise: float | None, form: str) -> tuple[Text, str]:
    """Return what is used and its limit; a broken one is marked by more than a colour."""
    measured = otherwise if row is None or row["measured"] is None else row["measured"]
    if measured is None:
        return Text("-"), "-"
    is_over = row is not None and measured > row["limit"]
    used = Text(format(measured, form) + ("!" if is_over else ""), _BAD if is_over else "")
    return used, "-" if row is None else format(row["limit"], form)


def _ticks(report: Report) -> Text:
    control = report["control_status"]
    if control is None:
        return Text("")
    late = control["late_ticks"] / max(control["tick"], 1)
    words = f"control: {1 / control['period_s']:.0f} Hz, {control['late_ticks']} of "
    return Text(f"{words}{control['tick']} ticks late ({100 * late:.2f} %)")


def _below(report: Report) -> Iterator[Text]:
    control = report["control_status"]
    for name, bus in (control["buses"] if control else {}).items():
        yield Text(f"bus {name}: {_bus_words(bus)}")
    battery = report["battery"]
    if battery is not None:
        style = _BAD if battery["critical"] else _POOR if battery["low"] else ""
        yield Text("battery: ").append(battery_words(battery), style)
    budget = report["budget"]
    if budget:
        steps = [f"{one['action']} {one['process'] or ''}" for one in budget["ladder"]["taken"]]
        yield Text(f"ladder: {', '.join(steps) or 'no steps in force'}", _POOR if steps else "")
    late = report["late_topics"]
    shown = [f"{one['topic']} {one['age_s']:.1f} s" for one in late[:_LATE_TOPICS]]
    more = f" and {len(late) - _LATE_TOPICS} more" if len(late) > _LATE_TOPICS else ""
    yield Text(f"topics: {report['topics']} written, late: {', '.join(shown) or 'none'}{more}")


def _bus_words(bus: Report) -> str:
    latency = bus.get("latency")
    wrong = ("timeouts", "crc_errors", "error_frames", "dropped", "link_lost", "lost_nodes")
    counts = [f"{name} {bus[name]}" for name in wrong if bus.get(name)]
    answers = f"answers p99 {1000 * latency['p99_s']:.1f} ms, " if latency else ""
    return f"{answers}{', '.join(counts) or 'no errors'}"
