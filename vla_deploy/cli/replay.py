"""`vla-deploy replay`: show a recording or a flight as if it were happening, without a robot."""

import argparse
import json
import os
import shutil
import signal
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.recorded_file import find_recorded
from vla_deploy.cli.session import Session, attach
from vla_deploy.runtime.logs import LOGS_DIR, RUN_ID_VARIABLE
from vla_deploy.runtime.node import run_node
from vla_deploy.supervisor.processes.process import ChildProcess
from vla_deploy.supervisor.runs.runtime import Runtime, default_base
from vla_deploy.telemetry.recorded_file import RecordedFile, read_file
from vla_deploy.telemetry.replay.node import ReplayNode

ANSWER_WITHIN_S: Final = 5.0
_STATUS_AGE_S: Final = 3.0
_PROFILE: Final = "desktop"
EXAMPLES = """  vla-deploy replay latest                 the newest recording, with its dashboard
  vla-deploy replay run.mcap --speed 4 --from 30 --loop
  vla-deploy replay /var/lib/vla-deploy/flights/000007-estop.mcap
  vla-deploy replay --pause                in another terminal; also --resume, --from 12, --speed 2
"""


def register(commands: Any) -> None:
    """Add the command."""
    replay = add_top_command(commands, "replay", EXAMPLES)
    replay.add_argument(
        "file", nargs="?", help="a file, the number of a recording, or: latest; none: the one shown"
    )
    replay.add_argument("--speed", type=float, metavar="X", help="so many times as fast")
    replay.add_argument("--from", type=float, dest="at_s", metavar="S", help="go on from there")
    replay.add_argument("--pause", action="store_true", help="stand still")
    replay.add_argument("--resume", action="store_true", help="go on after a pause")
    replay.add_argument("--loop", action="store_true", help="begin again at the end")
    replay.add_argument(
        "--dashboard",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="serve the page as well (default)",
    )
    replay.add_argument("--json", action="store_true", help="print what is shown as JSON")
    replay.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show a file until Ctrl-C, or tell the replay that goes on what to do.

    Raises:
        UsageError: neither a file nor an act was given.
    """
    if arguments.file is not None:
        return _show(arguments)
    if not _acts(arguments):
        raise UsageError("replay: name a file, or what the replay is to do; see: replay --help")
    return _ask(arguments)


def _show(arguments: argparse.Namespace) -> int:
    base = arguments.runtime_base or default_base()
    file = read_file(find_recorded(base, arguments.file))
    runtime = Runtime(base)
    stops: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda got, _frame: stops.append(got))
    page: ChildProcess | None = None
    clock = MonotonicClock()
    try:
        node = ReplayNode(runtime.run_dir, file, clock, loop=arguments.loop)
        _begin(node, arguments, clock.now_ns())
        print(
            f"{file.path.name}: {file.duration_s:.1f} s of what was recorded, "
            "no robot: no act reaches any; Ctrl-C ends it",
            flush=True,
        )
        page = _page(runtime, file) if arguments.dashboard else None
        address = _Address(Session(runtime.run_dir), wanted=page is not None)
        run_node(node, clock, lambda: address.tell() or bool(stops))
    finally:
        if page is not None:
            page.kill()
            page.exit_code()
        shutil.rmtree(runtime.run_dir / LOGS_DIR, ignore_errors=True)  # they are another run's
        runtime.close()
    return 0


class _Address:
    """Print where the page is, once it is there."""

    def __init__(self, session: Session, *, wanted: bool) -> None:
        self._session = session
        self._wanted = wanted

    def tell(self) -> bool:
        """Look, and return False: it is asked between two steps."""
        told = self._session.document("dashboard_status") if self._wanted else None
        if told is not None:
            self._wanted = False
            print(f"dashboard: {told['url']}", flush=True)
        return False


def _begin(node: ReplayNode, arguments: argparse.Namespace, now_ns: int) -> None:
    if arguments.speed is not None:
        node.playback.set_speed(now_ns, arguments.speed)
    if arguments.at_s is not None:
        node.playback.seek(now_ns, arguments.at_s)
    if arguments.pause:
        node.playback.pause(now_ns, paused=True)


def _page(runtime: Runtime, file: RecordedFile) -> ChildProcess:
    """Start the dashboard as a run's; it takes the next free port."""
    run_dir = runtime.run_dir
    command = ["-m", "vla_deploy.dashboard", "--run-dir", str(run_dir)]
    command += ["--robot", file.robot, "--profile", _PROFILE]
    command += ["--devices-dir", str(run_dir / "dev")]
    environment = {**os.environ, RUN_ID_VARIABLE: runtime.run_id}
    return ChildProcess(command, environment, run_dir / LOGS_DIR / "dashboard.out")


def _acts(arguments: argparse.Namespace) -> list[tuple[str, float]]:
    acts: list[tuple[str, float]] = []
    if arguments.at_s is not None:
        acts.append(("seek", arguments.at_s))
    if arguments.speed is not None:
        acts.append(("speed", arguments.speed))
    if arguments.pause:
        acts.append(("pause", 0.0))
    if arguments.resume:
        acts.append(("resume", 0.0))
    return acts


def _ask(arguments: argparse.Namespace) -> int:
    session = attach(arguments.runtime_base)
    if session.document("replay_status", _STATUS_AGE_S) is None:
        raise UsageError("what runs here is no replay; begin one: vla-deploy replay FILE")
    asked_ns = session.clock.now_ns()
    for act, value in _acts(arguments):
        session.publish("replay_request", {"act": act, "value": value})
    status = _answer(session, asked_ns)
    if status["refused"]:
        raise CommandFailed(f"the replay refuses: {status['refused']}")
    place = f"{status['position_s']:.1f} of {status['duration_s']:.1f} s"
    print(
        json.dumps(status, indent=2)
        if arguments.json
        else f"{status['file']}: {status['state']} at {place}, speed {status['speed']:g}"
    )
    return 0


def _answer(session: Session, asked_ns: int) -> dict[str, Any]:
    """Return the first status that was told a while after the asking.

    Raises:
        CommandFailed: none comes.
    """
    end_ns = asked_ns + round(ANSWER_WITHIN_S * NS_PER_S)
    while session.clock.now_ns() < end_ns:
        sample = session.fresh("replay_status")
        if sample is not None and sample.stamp_ns > asked_ns + NS_PER_S // 20:
            return sample.document()
        session.pause()
    raise CommandFailed("the replay does not answer; is it held up?")
