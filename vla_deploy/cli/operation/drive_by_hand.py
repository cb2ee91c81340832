"""Drive the base by this terminal's keys or by a gamepad, until Ctrl-C or a stop."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.cli.commands import emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.attended_motion import attended_motion
from vla_deploy.cli.session import RobotSession
from vla_deploy.cli.terminal import CLEAR_SCREEN, control
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.motion import ControlStatus
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import BaseGeometry
from vla_deploy.teleoperation.driving import (
    DRIVE_PERIOD_S,
    SPEED_RATIO,
    BaseDriver,
    DriveInput,
    DriveWish,
)
from vla_deploy.teleoperation.errors import HandMotionEnded
from vla_deploy.teleoperation.keyboard import DRIVE_KEYS, SIDEWAYS_KEYS, keys_of_terminal
from vla_deploy.teleoperation.pad_jog import PadDrive, gamepad_at

_PARTS: Final = ("base",)


def drive(arguments: argparse.Namespace, session: RobotSession, robot: RobotDescription) -> int:
    """Pass on what a person asks of the base, until it ends.

    Raises:
        UsageError: the robot has no base.
        CommandFailed: it is not armed, was stopped, or the input was lost.
    """
    base = robot.parts.base
    if base is None:
        raise UsageError(f"--base: {robot.name} has no base; leave it out to move its joints")
    began_ns = session.clock.now_ns()
    with (
        drive_input(arguments, session, base) as source,
        attended_motion(session, robot, "cli/teleoperate", _PARTS) as attended,
    ):
        writer = session.space.cell_writer(topics.HAND_BASE_COMMAND)
        driver = BaseDriver(base, writer, source, arguments.speed or SPEED_RATIO)
        screen = DriveScreen(session, arguments, base)
        why = ""
        due_ns = began_ns
        try:
            while not why:
                attended.require_wanted()
                status = session.document(topics.CONTROL_STATUS)
                why = refusal_of(status) or ""
                screen.show(driver.step(), status)
                due_ns = max(due_ns + round(DRIVE_PERIOD_S * NS_PER_S), session.clock.now_ns())
                session.clock.sleep_until(due_ns)
        except HandMotionEnded as error:
            why = str(error)
        except KeyboardInterrupt:
            pass
        finally:
            driver.stop()
    if why:
        raise CommandFailed(f"{why}; the base comes to rest")
    seconds = (session.clock.now_ns() - began_ns) / NS_PER_S
    document = {"duration_s": round(seconds, 3), "told": driver.told, "ended": "Ctrl-C"}
    return emit(arguments, document, f"ended by Ctrl-C after {seconds:.0f} s; the base stands")


@contextmanager
def drive_input(
    arguments: argparse.Namespace, session: RobotSession, base: BaseGeometry
) -> Iterator[DriveInput]:
    """Open the keyboard or the gamepad for a `with` block."""
    if arguments.keyboard:
        table = {**DRIVE_KEYS, **(SIDEWAYS_KEYS if base.is_holonomic else {})}
        with keys_of_terminal(session.clock, table, DriveWish()) as keyboard:
            yield keyboard
    else:
        with gamepad_at(arguments.gamepad, session.clock) as pad:
            yield PadDrive(pad)


class DriveScreen:
    """Show the keys, how fast the base moves, and what holds it, in place."""

    def __init__(
        self, session: RobotSession, arguments: argparse.Namespace, base: BaseGeometry
    ) -> None:
        self._session = session
        self._quiet = arguments.json or not sys.stdout.isatty()
        aside = ", a and d: sideways" if base.is_holonomic else ""
        keys = f"arrows: ahead, back, turn{aside}; any other key: stop; Ctrl-C: end"
        pad = "hold the left shoulder; left stick: drive, right stick: turn; Ctrl-C: end"
        self._head = keys if arguments.keyboard else pad

    def show(self, wish: DriveWish, status: ControlStatus | None) -> None:
        """Show them, on a terminal; `status` is control's."""
        if self._quiet:
            return
        state = self._session.fresh(topics.BASE_STATE)
        lines = [self._head]
        if state is not None:
            moved = state.data
            lines.append(
                f"{float(moved['v_m_s']):+.2f} m/s  {float(moved['w_rad_s']):+.2f} rad/s  "
                f"left {float(moved['left_m_s']):+.2f} m/s"
            )
        if status is not None and status["cause"]:
            lines.append(f"held by {status['cause']}: {status['detail'] or status['state']}")
        elif wish == DriveWish():
            lines.append("nothing asked for")
        control(CLEAR_SCREEN)
        print("\n".join(lines), flush=True)
