"""`vla-deploy replay`: show a recording or a flight as if it were happening, without a robot."""

import argparse
import os
import shutil
import signal
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.recording.runs import find_recorded, stop_requested
from vla_deploy.cli.session import RobotSession, attach, base_of
from vla_deploy.client.access.errors import LoginLinkUnavailable
from vla_deploy.client.access.login_link import login_url
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.recording import ReplayAct, ReplayStatus
from vla_deploy.runtime.logs import LOGS_DIR, RUN_ID_VARIABLE
from vla_deploy.runtime.node import run_node
from vla_deploy.supervisor.processes.process import ChildProcess
from vla_deploy.supervisor.runs.runtime import Runtime
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
    replay = add_top_command(
        commands, "replay", EXAMPLES, run, json_help="print the state of the replay as JSON"
    )
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


def run(arguments: argparse.Namespace) -> int:
    """Show a file until Ctrl-C, or send acts to the replay that runs.

    Raises:
        UsageError: neither a file nor an act was given.
    """
    if arguments.file is not None:
        return _show(arguments)
    if not _acts(arguments):
        raise UsageError("replay: name a file, or what the replay is to do; see: replay --help")
    return _ask(arguments)


def _show(arguments: argparse.Namespace) -> int:
    base = base_of(arguments)
    file = read_file(find_recorded(base, arguments.file))
    runtime = Runtime(base)
    is_stopped = stop_requested(signal.SIGHUP)
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
        address = _Address(RobotSession(runtime.run_dir), wanted=page is not None)

        def should_stop() -> bool:
            address.print_once()
            return is_stopped()

        run_node(node, clock, should_stop)
    finally:
        if page is not None:
            page.kill()
            page.exit_code()
        shutil.rmtree(runtime.run_dir / LOGS_DIR, ignore_errors=True)  # they are another run's
        runtime.close()
    return 0


class _Address:
    """Print the page's address as soon as the dashboard publishes it."""

    def __init__(self, session: RobotSession, *, wanted: bool) -> None:
        self._session = session
        self._wanted = wanted

    def print_once(self) -> None:
        """Print it, if that is still to be done and it is known."""
        status = self._session.document(topics.DASHBOARD_STATUS) if self._wanted else None
        if status is not None:
            self._wanted = False
            print(f"dashboard: {_link(self._session.run_dir, status['url'])}", flush=True)


def _link(run_dir: Path, url: str) -> str:
    try:
        return login_url(run_dir, url)
    except LoginLinkUnavailable as error:
        return f"{url} ({error})"


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


def _acts(arguments: argparse.Namespace) -> list[tuple[ReplayAct, float]]:
    acts: list[tuple[ReplayAct, float]] = []
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
    if session.document(topics.REPLAY_STATUS, _STATUS_AGE_S) is None:
        raise UsageError("what runs here is no replay; begin one: vla-deploy replay FILE")
    asked_ns = session.clock.now_ns()
    for act, value in _acts(arguments):
        session.writer(topics.REPLAY_REQUEST).publish({"act": act, "value": value})

    def look() -> ReplayStatus | None:
        sample = session.fresh(topics.REPLAY_STATUS)
        is_later = sample is not None and sample.stamp_ns > asked_ns + NS_PER_S // 20
        return sample.document() if sample is not None and is_later else None

    status = session.wait_for(look, ANSWER_WITHIN_S)
    if status is None:
        raise CommandFailed("the replay does not answer; is it held up?")
    if status["refused"]:
        raise CommandFailed(f"the replay refuses: {status['refused']}")
    position = f"{status['position_s']:.1f} of {status['duration_s']:.1f} s"
    line = f"{status['file']}: {status['state']} at {position}, speed {status['speed']:g}"
    return emit(arguments, status, line)
