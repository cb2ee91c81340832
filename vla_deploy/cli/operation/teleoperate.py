"""`vla-deploy teleoperate`: move arm or base by hand, by the limits and safety of any motion."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S
from drivers.servo.family import FAMILIES, family_of, servo_family
from vla_deploy.cli.commands import add_top_command, emit, number_within, whole_number
from vla_deploy.cli.devices.console import Console
from vla_deploy.cli.devices.servo_bus import ServoBusPort
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.attended_motion import AttendedMotion, attended_motion
from vla_deploy.cli.operation.drive_by_hand import drive
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.cli.terminal import CLEAR_SCREEN, control
from vla_deploy.client.motions import JointView, joint_view
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.calibration.lerobot_file import read_lerobot, write_lerobot
from vla_deploy.robots.loader import robot_names
from vla_deploy.teleoperation.driving import SPEED_RATIO
from vla_deploy.teleoperation.errors import HandMotionEnded
from vla_deploy.teleoperation.following import PERIOD_S, HandFollowing
from vla_deploy.teleoperation.hand_pose import Floats, HandInput
from vla_deploy.teleoperation.jogging import JogHand, JogInput, JogWish
from vla_deploy.teleoperation.keyboard import (
    DEAD_MAN_S,
    key_table,
    keys_of,
    keys_of_terminal,
)
from vla_deploy.teleoperation.leader_arm import LeaderArm, open_leader
from vla_deploy.teleoperation.leader_calibration import calibrated_leader
from vla_deploy.teleoperation.leader_robot import open_leader_robot
from vla_deploy.teleoperation.pad_jog import PadJog, gamepad_at

SCREEN_S: Final = 0.1
EXAMPLES: Final = """\
  vla-deploy teleoperate --leader so101_leader --approach
  vla-deploy teleoperate --leader /dev/ttyACM1 --calibration lead.json --calibrate --robot so101
  vla-deploy teleoperate --leader /dev/ttyACM1 --calibration lead.json --approach
  vla-deploy teleoperate --keyboard
  vla-deploy teleoperate --gamepad
  vla-deploy teleoperate --keyboard --base
"""


def register(commands: Any) -> None:
    """Add the command."""
    command = add_top_command(
        commands, "teleoperate", EXAMPLES, run, json_help="print how it ended as JSON"
    )
    hand = command.add_mutually_exclusive_group(required=True)
    hand.add_argument(
        "--leader",
        type=Path,
        metavar="ROBOT|PORT",
        help="follow the leader arm of this robot file, or at this port with --calibration; it has "
        "no torque, and nothing is written to it",
    )
    hand.add_argument(
        "--keyboard",
        action="store_true",
        help=f"jog by this terminal's keys; none for {DEAD_MAN_S:g} s stops",
    )
    hand.add_argument(
        "--gamepad",
        type=Path,
        nargs="?",
        const=Path(),
        metavar="DEVICE",
        help="jog by a gamepad (default: the one that is plugged in) with its left shoulder held",
    )
    command.add_argument(
        "--base", action="store_true", help="drive the base by keys or sticks, not the arm"
    )
    command.add_argument(
        "--speed",
        type=number_within(0.05, 1.0, "a number from 0.05 to 1"),
        metavar="RATIO",
        help=f"of the base's top speed, with --base (default: {SPEED_RATIO:g})",
    )
    command.add_argument(
        "--calibration",
        type=Path,
        metavar="FILE",
        help="the leader's calibration, LeRobot's or that of --calibrate",
    )
    command.add_argument(
        "--calibrate", action="store_true", help="make that file: you move the leader, then end"
    )
    command.add_argument("--family", choices=FAMILIES, help="of its servos (default: the robot's)")
    command.add_argument(
        "--baud",
        type=whole_number(),
        metavar="N",
        help="speed of its servos in bit/s (default: the robot's)",
    )
    command.add_argument(
        "--port", type=Path, help="of a leader with a robot file (default: as its file says)"
    )
    command.add_argument(
        "--approach",
        action="store_true",
        help="let the robot go slowly to a leader's pose that is far away",
    )
    command.add_argument(
        "--robot", help="this robot must be the one that runs; needed with --calibrate"
    )


def run(arguments: argparse.Namespace) -> int:
    """Follow a hand until Ctrl-C, a stop, or the loss of what the hand moves.

    Raises:
        UsageError: the arguments do not fit together, or another robot runs.
        LeaderUnusable: the leader has torque, or its calibration is not the robot's.
        CommandFailed: the robot is not armed, was stopped, or the leader was lost.
    """
    if arguments.base and arguments.leader is not None:
        raise UsageError("--base: expected --keyboard or --gamepad, a leader has no wheels")
    if arguments.speed is not None and not arguments.base:
        raise UsageError("--speed: expected --base, whose speed it bounds")
    leads = None if arguments.leader is None else leader_robot(arguments)
    if arguments.leader is not None and leads is None and arguments.calibration is None:
        raise UsageError(
            f"--leader {arguments.leader}: expected a leader's robot file, such as so101_leader, "
            "or a port with --calibration FILE, LeRobot's or one that --calibrate makes"
        )
    if arguments.calibrate and arguments.leader is None:
        raise UsageError("--calibrate: expected --leader PORT, which is calibrated")
    if arguments.calibrate:
        return _calibrate(arguments)
    session = attach(arguments.runtime_base)
    robot = session.running_robot()
    if arguments.robot is not None and load_robot(arguments.robot).name != robot.name:
        raise UsageError(f"--robot {arguments.robot}: {robot.name} runs")
    if arguments.base:
        return drive(arguments, session, robot)
    if arguments.leader is not None:
        opened = leader_of if leads is None else partial(leader_of_file, leads)
        with opened(arguments, session, robot) as leader:
            return _follow(arguments, session, robot, leader)
    with jog_input(arguments, session, robot) as source:
        hand = JogHand(robot, session.clock, source, lambda: _setpoints(session, robot))
        return _follow(arguments, session, robot, hand)


def _setpoints(session: RobotSession, robot: RobotDescription) -> Floats | None:
    view = joint_view(session, robot.joint_index, robot.joint_names)
    return None if view is None else view.setpoint


@contextmanager
def jog_input(
    arguments: argparse.Namespace, session: RobotSession, robot: RobotDescription
) -> Iterator[JogInput]:
    """Open the keyboard or the gamepad for a `with` block."""
    if arguments.keyboard:
        table = key_table(robot.joint_names)
        with keys_of_terminal(session.clock, table, JogWish()) as keyboard:
            yield keyboard
    else:
        with gamepad_at(arguments.gamepad, session.clock) as pad:
            yield PadJog(pad, robot.joint_names, robot.gripper_joints)


def leader_robot(arguments: argparse.Namespace) -> RobotDescription | None:
    """Return the robot that `--leader` names, None where it is a port.

    Raises:
        UsageError: the robot is no leader, or an option is given that only a port takes.
        RobotFileError: its file has faults.
    """
    given: Path = arguments.leader
    if str(given) not in robot_names() and not given.is_dir() and given.suffix != ".toml":
        return None
    leader = load_robot(given)
    if not leader.read_only:
        raise UsageError(f"--leader {given}: {leader.name} is no leader: `read_only` in its file")
    names = ("calibration", "calibrate", "family", "baud")
    if unfit := [f"--{name}" for name in names if getattr(arguments, name)]:
        raise UsageError(
            f"{', '.join(unfit)}: the file of {leader.name} says it; it is calibrated by: "
            f"vla-deploy servo calibrate --robot {given}"
        )
    return leader


@contextmanager
def leader_of_file(
    leader: RobotDescription,
    arguments: argparse.Namespace,
    session: RobotSession,
    robot: RobotDescription,
) -> Iterator[LeaderArm]:
    """Open a leader with a robot file for a `with` block."""
    bus = leader.servo_bus
    family = family_of(bus.servos[0].model)
    port = ServoBusPort(port=arguments.port or Path(bus.path), baud=bus.baud, family=family)
    with port.open() as bench:
        yield open_leader_robot(bench, session.clock, robot, leader)


@contextmanager
def leader_of(
    arguments: argparse.Namespace, session: RobotSession, robot: RobotDescription
) -> Iterator[LeaderArm]:
    """Open the leader for a `with` block."""
    port = leader_port(arguments, robot)
    if not arguments.calibration.exists():
        raise UsageError(
            f"--calibration {arguments.calibration}: no such file; make it: add --calibrate "
            f"--robot {robot.name}, which takes a minute"
        )
    motors = read_lerobot(arguments.calibration)
    with port.open() as bench:
        yield open_leader(bench, session.clock, robot, motors, port.family.name)


def leader_port(arguments: argparse.Namespace, robot: RobotDescription) -> ServoBusPort:
    """Return the leader's port; what is not given is as the robot has it."""
    bus = robot.servo_bus
    name = arguments.family
    return ServoBusPort(
        port=arguments.leader,
        baud=arguments.baud or bus.baud,
        family=servo_family(name) if name else family_of(bus.servos[0].model),
    )


def _calibrate(arguments: argparse.Namespace) -> int:
    if arguments.robot is None:
        raise UsageError("--calibrate: expected --robot NAME, whose joints the leader has")
    robot = load_robot(arguments.robot)
    port = leader_port(arguments, robot)
    with port.open() as bench:
        person = Console(quiet=arguments.json)
        motors = calibrated_leader(bench, robot, port.family.name, person)
    write_lerobot(arguments.calibration, motors)
    report = {name: [one.range_min, one.range_max] for name, one in motors.items()}
    lines = [f"{name}: {low} to {high}" for name, (low, high) in report.items()]
    return emit(arguments, report, "\n".join([*lines, f"written to {arguments.calibration}"]))


def _follow(
    arguments: argparse.Namespace,
    session: RobotSession,
    robot: RobotDescription,
    hand: HandInput,
) -> int:
    began_ns = session.clock.now_ns()
    parts = robot.groups_moving(hand.joints)
    with attended_motion(session, robot, "cli/teleoperate", parts) as attended:
        following = HandFollowing(attended.motions, robot, hand, approach=arguments.approach)
        screen = JogScreen(session, robot, arguments) if arguments.leader is None else None
        why = _until_ended(session, attended, following, screen)
    document = {
        "duration_s": round((session.clock.now_ns() - began_ns) / NS_PER_S, 3),
        "goals": following.goals,
        "followed": following.has_met,
        "largest_distance": round(following.largest_distance, 4),
        "ended": why or "Ctrl-C",
    }
    if why:
        raise CommandFailed(f"{why}; the joints come to rest where they are")
    text = (
        f"ended by Ctrl-C after {document['duration_s']:.0f} s; the joints were within "
        f"{following.largest_distance:.3f} of the hand, and hold where they are"
    )
    return emit(arguments, document, text)


class JogScreen:
    """Show the joints and their keys in place, ten times a second."""

    def __init__(
        self, session: RobotSession, robot: RobotDescription, arguments: argparse.Namespace
    ) -> None:
        self._session = session
        self._robot = robot
        self._quiet = arguments.json or not sys.stdout.isatty()
        self._keys = keys_of(robot.joint_names) if arguments.keyboard else {}
        self._shown_ns = 0

    def show(self) -> None:
        """Show them, where it is time to."""
        now_ns = self._session.clock.now_ns()
        if self._quiet or now_ns - self._shown_ns < SCREEN_S * NS_PER_S:
            return
        self._shown_ns = now_ns
        robot = self._robot
        view = joint_view(self._session, robot.joint_index, robot.joint_names)
        if view is not None:
            control(CLEAR_SCREEN)
            print("\n".join(self._lines(view)), flush=True)

    def _lines(self, view: JointView) -> Iterator[str]:
        keyboard = "arrows, page up, page down: the hand; any other key: stop; Ctrl-C: end"
        pad = "hold the left shoulder to move, the right one, too, for the hand; Ctrl-C: end"
        yield keyboard if self._keys else pad
        width = max(map(len, self._robot.joint_names))
        yield f"{'':{width}}  position  setpoint  range"
        for row, name in enumerate(self._robot.joint_names):
            limits = self._robot.limits[name]
            yield (
                f"{name:{width}}  {view.position[row]:8.3f}  {view.setpoint[row]:8.3f}"
                f"  {limits.min:.2f} to {limits.max:.2f}  {self._keys.get(name, '')}"
            )


def _until_ended(
    session: RobotSession,
    attended: AttendedMotion,
    following: HandFollowing,
    screen: JogScreen | None,
) -> str:
    """Follow until it ends; return why, "" for Ctrl-C."""
    due_ns = session.clock.now_ns()
    try:
        while True:
            attended.require_wanted()
            following.step()
            if screen is not None:
                screen.show()
            now_ns = session.clock.now_ns()
            due_ns = max(due_ns + round(PERIOD_S * NS_PER_S), now_ns)
            session.clock.sleep_until(due_ns)
    except HandMotionEnded as error:
        return str(error)
    except KeyboardInterrupt:
        return ""
