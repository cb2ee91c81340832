"""Enter every robot process the same way: arguments, log, signals, priority, exit code."""

import argparse
import ctypes
import logging
import os
import signal
from collections.abc import Callable, Sequence
from pathlib import Path

from drivers.clock import Clock
from drivers.errors import DeviceBusy, DeviceMissing, DriverError, LinkLost, NoReply
from drivers.twin_clock import TwinClock, clock_of
from platforms import ProfileError, load_profile
from vla_deploy.ipc import IpcError
from vla_deploy.robots.errors import RobotError
from vla_deploy.runtime.executors import InlineExecutor, low_priority_thread
from vla_deploy.runtime.exit_codes import (
    EXIT_CONFIGURATION,
    EXIT_CRASHED,
    EXIT_DEVICE_ABSENT,
    EXIT_OK,
)
from vla_deploy.runtime.host_settings import REALTIME_PROCESS, HostSettings
from vla_deploy.runtime.logs import process_log
from vla_deploy.runtime.malloc_tuning import give_large_blocks_back
from vla_deploy.runtime.node import Node, NodeContext, run_node
from vla_deploy.runtime.open_files import keep_files_private, raise_open_files
from vla_deploy.runtime.reconfigurable_node import ReconfigurableNode
from vla_deploy.runtime.twin_members import MEMBERSHIPS, STOPPING_NS, WATCHERS

READY_DIR = "ready"
# An adapter may be slow to appear at boot, a supply be switched on later, a dying holder let go.
ABSENCES = (DeviceMissing, DeviceBusy, LinkLost, NoReply)
# Starting again mends none of the others: a person has to.
CONFIGURATION_ERRORS = (DriverError, RobotError, ProfileError, IpcError)
_PR_SET_NAME = 15
_log = logging.getLogger(__name__)


Stepper = Callable[[Node, Clock, Callable[[], bool]], None]


def main(
    name: str,
    build: Callable[[NodeContext], Node],
    arguments: Sequence[str] | None = None,
    run: Stepper = run_node,
    mendable: tuple[type[Exception], ...] = (),
    adapts: bool = True,
) -> int:
    """Run one node until SIGTERM or SIGINT, and return the exit code of its process.

    The file `<run_dir>/ready/<name>` holds the pid while the node is started. `run` starts, steps
    and stops the node; one that does more than that beside the steps is given for it.
    `mendable` are errors of this process that a person has to mend, beside those of all. One that
    does not adapt runs alike under every profile, also under one that cannot be read.
    """
    context = _context(name, arguments)
    _name_process(name)
    give_large_blocks_back()
    raise_open_files()
    keep_files_private()
    stop_signals = _catch_stop_signals()
    with process_log(name, context.robot, context.run_dir, context.clock):
        try:
            built = _adapting(name, build, context) if adapts else build(context)
            node = _Announced(name, built, context)
            if isinstance(context.clock, TwinClock) and name in MEMBERSHIPS:
                context.clock.join(MEMBERSHIPS[name].role, os.getpid())
            run(node, context.clock, lambda: bool(stop_signals))
        except ABSENCES as error:
            _log.error("%s", error)
            return EXIT_DEVICE_ABSENT
        except CONFIGURATION_ERRORS + mendable as error:
            _log.error("%s", error)
            return EXIT_CONFIGURATION
        except Exception:  # the last place where a crash can be told to the log
            _log.exception("crashed")
            return EXIT_CRASHED
        return EXIT_OK


def _adapting(
    name: str, build: Callable[[NodeContext], Node], context: NodeContext
) -> ReconfigurableNode:
    """Set this process up for the profile, build its node and let it follow later profiles."""
    profile = load_profile(context.profile)
    host = HostSettings(name)
    for refused in host.apply(profile):
        _log.warning("degraded: %s", refused)
    return ReconfigurableNode(
        name,
        build(context),
        profile,
        ipc=context.run_dir / "ipc",
        clock=context.clock,
        host=host,
        # Control prepares two numbers; a thread that holds the interpreter could cost it a tick.
        executor=InlineExecutor()
        if name == REALTIME_PROCESS
        else low_priority_thread(context.clock),
    )


class _Announced:
    """Announce by a file that a node is started."""

    def __init__(self, name: str, node: Node, context: NodeContext) -> None:
        self._name = name
        self._ready_file = context.run_dir / READY_DIR / name
        self._clock = context.clock
        self._node = node
        self.step = node.step

    @property
    def period_s(self) -> float:
        return self._node.period_s

    def start(self) -> None:
        self._node.start()
        self._ready_file.parent.mkdir(exist_ok=True)
        self._ready_file.write_text(f"{os.getpid()}\n")

    def stop(self) -> None:
        self._ready_file.unlink(missing_ok=True)
        if isinstance(self._clock, TwinClock) and self._name in WATCHERS:
            self._clock.hold_until(self._clock.now_ns() + STOPPING_NS)
        self._node.stop()


def _context(name: str, arguments: Sequence[str] | None) -> NodeContext:
    parser = argparse.ArgumentParser(
        prog=f"vla-{name}",
        description=f"Run the robot's {name} process; normally the supervisor starts it.",
    )
    parser.add_argument("--run-dir", type=Path, required=True, help="directory of the run")
    parser.add_argument("--robot", required=True, help="robot name or folder, e.g. butler")
    parser.add_argument("--profile", required=True, help="platform profile, e.g. desktop")
    parser.add_argument("--devices-dir", type=Path, help="take every device from here instead")
    given = parser.parse_args(arguments)
    if not given.run_dir.is_dir():
        parser.error(f"--run-dir {given.run_dir}: no such directory; is the run still up?")
    return NodeContext(
        run_dir=given.run_dir,
        robot=given.robot,
        profile=given.profile,
        devices_dir=given.devices_dir,
        clock=clock_of(given.run_dir),
    )


def _name_process(name: str) -> None:
    ctypes.CDLL(None).prctl(_PR_SET_NAME, f"vla-{name}".encode(), 0, 0, 0)


def _catch_stop_signals() -> list[int]:
    caught: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda got, _frame: caught.append(got))
    return caught
