"""`vla-deploy top`: processes, budgets, control and topics on one screen, for who came by ssh.

The numbers come out of shared memory: the dashboard is not needed for it.
"""

import argparse
import contextlib
import json
import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from typing import Any, Final

from rich.console import Console
from rich.live import Live

from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.session import Session, attach
from vla_deploy.cli.top_screen import screen
from vla_deploy.ipc import TOPICS, PulseReader

DOCUMENTS: Final = (
    *(
        "process_table",
        "control_status",
        "budget",
        "executor_status",
        "planner_status",
        "board",
        "twin_status",
    ),
)
AGE_LIMIT_S: Final = 3.0
_LONGEST_S: Final = 3600.0
_EXAMPLES: Final = "  vla-deploy top\n  vla-deploy top --once\n  vla-deploy top --once --json\n"


def register(commands: Any) -> None:
    """Add the command."""
    top = add_top_command(commands, "top", _EXAMPLES)
    top.add_argument("--once", action="store_true", help="show it once, and end")
    top.add_argument("--json", action="store_true", help="print it as JSON, one object a line")
    top.add_argument("--every", type=_seconds, default=1.0, metavar="S", help="seconds (default 1)")
    top.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show the run on this machine until `q` or Ctrl-C."""
    looker = TopLooker(attach(arguments.runtime_base))
    if arguments.json:
        return _print_json(looker, arguments)
    console = Console()
    is_screen = console.is_terminal and not console.is_dumb_terminal
    if arguments.once or not console.is_terminal:
        console.print(screen(looker.look()), soft_wrap=False)
        return 0
    return _follow(looker, console, arguments.every, is_screen=is_screen)


class TopLooker:
    """Follow what the screen shows."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._pulses: dict[str, PulseReader] = {
            topic.name: session.space.pulse_reader(topic.name) for topic in TOPICS
        }

    def look(self) -> dict[str, Any]:
        """Return what the processes tell, null where one is silent, and which topics are late."""
        told = {name: self.session.document(name, AGE_LIMIT_S) for name in DOCUMENTS}
        return {**told, **self._topics(self.session.clock.now_ns())}

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


def _print_json(looker: TopLooker, arguments: argparse.Namespace) -> int:
    while True:
        print(json.dumps(looker.look()), flush=True)
        if arguments.once:
            return 0
        looker.session.pause(arguments.every)


def _follow(looker: TopLooker, console: Console, every_s: float, *, is_screen: bool) -> int:
    if not is_screen:
        while True:
            console.print(screen(looker.look()), soft_wrap=False)
            looker.session.pause(every_s)
    with _keys() as pressed, Live(console=console, screen=True, auto_refresh=False) as live:
        while True:
            live.update(screen(looker.look()), refresh=True)
            if pressed(every_s) == "q":
                return 0


@contextlib.contextmanager
def _keys() -> Iterator[Any]:
    """Give a function that waits for a key, and put the terminal back afterwards."""
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


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0.1 <= seconds <= _LONGEST_S:
        raise argparse.ArgumentTypeError(f"expected 0.1 to {_LONGEST_S:g} s, got {text}")
    return seconds
