"""`vla-deploy estop | reset | arm | disarm | stop | shutdown`: an operator's acts."""

import argparse
import json
import os
import signal
from collections.abc import Callable
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.session import Session, attach
from vla_deploy.client.acts import REACHED, Status, why_not
from vla_deploy.client.readiness import refusal_of
from vla_deploy.supervisor.runs.runtime import default_base, running

WAIT_S = 5.0


def register(commands: Any) -> None:
    """Add the commands."""
    for act in REACHED:
        command = add_top_command(commands, act, f"  vla-deploy {act}\n")
        command.add_argument("--reason", default="", help="why, for the log")
        command.add_argument("--json", action="store_true", help="print control's status as JSON")
        command.set_defaults(run=run, act=act)
    stop = add_top_command(commands, "stop", "  vla-deploy stop\n")
    stop.set_defaults(run=run_stop)
    shutdown = add_top_command(
        commands,
        "shutdown",
        "  vla-deploy shutdown\n",
    )
    shutdown.set_defaults(run=run_shutdown)


def run(arguments: argparse.Namespace) -> int:
    """Publish the act and wait until control shows it.

    Raises:
        CommandFailed: control did not do it in time.
    """
    session = attach(arguments.runtime_base)
    session.operate(arguments.act, arguments.reason)
    status = _wait(session, REACHED[arguments.act])
    if arguments.json:
        print(json.dumps(status, indent=2))
    else:
        print(f"control: {status['state']}" + (f" ({status['cause']})" if status["cause"] else ""))
    return 0


def _wait(session: Session, reached: Callable[[Status], bool]) -> dict[str, Any]:
    end_ns = session.clock.now_ns() + round(WAIT_S * NS_PER_S)
    status = None
    while session.clock.now_ns() < end_ns:
        status = session.document("control_status", age_limit_s=1.0)
        if status is not None and reached(status):
            return status
        session.pause()
    raise CommandFailed(f"{why_not(status)}; see: vla-deploy status")


def run_stop(arguments: argparse.Namespace) -> int:
    """Cancel the running command; the robot comes to rest and stays armed."""
    session = attach(arguments.runtime_base)
    session.cancel()
    refusal = refusal_of(session.document("control_status", age_limit_s=1.0))
    print(f"stopped; {refusal or 'the robot is ready'}")
    return 0


def run_shutdown(arguments: argparse.Namespace) -> int:
    """Ask the supervisor to stop everything in order, and wait for it.

    Raises:
        CommandFailed: it did not end in time.
    """
    session = attach(arguments.runtime_base)
    base = arguments.runtime_base or default_base()
    owner = running(base)
    if owner is None:
        return 0
    os.kill(owner.pid, signal.SIGTERM)
    end_ns = session.clock.now_ns() + 30 * NS_PER_S
    while owner.is_alive():
        if session.clock.now_ns() > end_ns:
            raise CommandFailed(f"the supervisor (pid {owner.pid}) did not end within 30 s")
        session.pause()
    print("the run has ended")
    return 0
