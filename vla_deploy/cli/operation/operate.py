"""The acts of an operator: estop, reset, arm, disarm, stop, pause, resume, shutdown."""

import argparse
import os
import signal
from typing import Any

from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import attach, base_of
from vla_deploy.client.acts import REACHED, why_not
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.motion import ControlStatus
from vla_deploy.supervisor.runs.runtime import running

WAIT_S = 5.0
SHUTDOWN_S = 30.0


def register(commands: Any) -> None:
    """Add the commands."""
    for act in REACHED:
        command = add_top_command(
            commands, act, f"  vla-deploy {act}\n", run, json_help="print control's status as JSON"
        )
        command.add_argument("--reason", default="", help="why, for the log")
        command.set_defaults(act=act)
    add_top_command(commands, "stop", "  vla-deploy stop\n", run_stop)
    for name in ("pause", "resume"):
        command = add_top_command(commands, name, f"  vla-deploy {name}\n", run_pause)
        command.set_defaults(pause=name == "pause")
    add_top_command(commands, "shutdown", "  vla-deploy shutdown\n", run_shutdown)


def run(arguments: argparse.Namespace) -> int:
    """Publish the act and wait until control reports its effect.

    Raises:
        CommandFailed: control did not carry it out in time.
    """
    session = attach(arguments.runtime_base)
    session.operate(arguments.act, arguments.reason)

    def reached() -> ControlStatus | None:
        status = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
        return status if status is not None and REACHED[arguments.act](status) else None

    status = session.wait_for(reached, WAIT_S)
    if status is None:
        last = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
        raise CommandFailed(f"{why_not(last)}; see: vla-deploy status")
    cause = f" ({status['cause']})" if status["cause"] else ""
    return emit(arguments, status, f"control: {status['state']}{cause}")


def run_stop(arguments: argparse.Namespace) -> int:
    """Cancel the running command; the robot comes to rest and stays armed."""
    session = attach(arguments.runtime_base)
    session.cancel()
    refusal = refusal_of(session.document(topics.CONTROL_STATUS, age_limit_s=1.0))
    print(f"stopped; {refusal or 'the robot is ready'}")
    return 0


def run_pause(arguments: argparse.Namespace) -> int:
    """Have what goes on come to rest, holding what it holds, or go on from there.

    Raises:
        CommandFailed: nothing is under way, or planner and executor do not answer.
    """
    session = attach(arguments.runtime_base)
    *_, last = session.command(pause=arguments.pause)
    if last["event"] != "finished" or not last["success"]:
        raise CommandFailed(last.get("error") or last.get("reason") or "no answer")
    print("paused; go on with: vla-deploy resume" if arguments.pause else "the robot goes on")
    return 0


def run_shutdown(arguments: argparse.Namespace) -> int:
    """Ask the supervisor to stop everything in order, and wait for it.

    Raises:
        CommandFailed: it did not end in time.
    """
    session = attach(arguments.runtime_base)
    owner = running(base_of(arguments))
    if owner is None:
        return 0
    os.kill(owner.pid, signal.SIGTERM)
    if not session.wait_for(lambda: not owner.is_alive() or None, SHUTDOWN_S):
        raise CommandFailed(f"the supervisor (pid {owner.pid}) did not end within {SHUTDOWN_S:g} s")
    print("the run has ended")
    return 0
