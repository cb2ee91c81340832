"""`vla-deploy joint play`: replay an episode of a LeRobot dataset through control's limits."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.servo.tools.travel import PULSE_RAD
from vla_deploy.cli.commands import add_command, emit, number_within, whole_number
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.attended_motion import attended_motion
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.client.motions import GRIPPER_EFFORT_RATIO
from vla_deploy.client.path_player import DONE, PathPlayer, PlayedPath
from vla_deploy.client.path_windows import PathWindow, TimedPath, windows_of
from vla_deploy.robots import RobotDescription

if TYPE_CHECKING:  # what reads datasets loads OpenCV and the extra
    from vla_deploy.telemetry.lerobot.reader import EpisodeActions

Floats = NDArray[np.float64]
APPROACH_SPEED_RATIO: Final = 0.2
"""Of the top speeds, on the way to the first pose."""
JUDGED_SPEED_RATIO: Final = 0.97
"""Of the top speeds, that a path may need: a takeover adds a little to what was judged."""
_SLOWER: Final = (0.75, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05)
_EXAMPLES: Final = """\
  vla-deploy joint play pick_cube --episode 3
  vla-deploy joint play pick_cube --speed 0.5 --clip
  vla-deploy joint play ~/.cache/huggingface/lerobot/me/old_dataset --unit range
"""


def register(acts: Any) -> None:
    """Add the command."""
    summary = "replay an episode of a LeRobot dataset, through the limits and safety of any motion"
    play = add_command(
        acts, "play", summary, _EXAMPLES, run, json_help="print how it ended as JSON"
    )
    play.add_argument("dataset", type=Path, help="the dataset's folder")
    play.add_argument(
        "--episode", type=whole_number(0), default=0, metavar="N", help="its number (default: 0)"
    )
    play.add_argument(
        "--speed",
        type=number_within(0.01, 1.0, "a share of the episode's speed from 0.01 to 1"),
        default=1.0,
        metavar="X",
        help="so many times as fast as recorded, at most 1 (default)",
    )
    play.add_argument(
        "--unit",
        choices=("degrees", "range"),
        default="degrees",
        help="of joints that are no gripper in the dataset, which does not say it (default: "
        "degrees; datasets of LeRobot before v0.4.4: range, -100 to 100)",
    )
    play.add_argument(
        "--clip", action="store_true", help="go to a joint's limit where the episode goes beyond it"
    )


def run(arguments: argparse.Namespace) -> int:
    """Judge the whole episode, go to its first pose slowly, and play it; Ctrl-C ends it.

    Raises:
        UsageError: the episode is not of this robot, or leaves its limits; nothing has moved.
        DatasetUnusable: the dataset cannot be read.
        CommandFailed: the robot is not armed, something else moves it, or it was stopped.
    """
    from vla_deploy.robots.calibration.lerobot_units import LeRobotUnit
    from vla_deploy.telemetry.lerobot.reader import LeRobotDataset

    session = attach(arguments.runtime_base)
    robot = session.running_robot()
    episode = LeRobotDataset(arguments.dataset).episode(arguments.episode)
    path = path_of(robot, episode, LeRobotUnit(arguments.unit), arguments.speed)
    path = within_limits(robot, path, clip=arguments.clip).thinned()
    require_followable(robot, path, arguments.speed)
    played = _play(session, robot, path)
    if played.ended.status != DONE:
        at_s = played.frame / path.frames_per_s
        reason = f"{played.ended.status}, {played.ended.reason}"
        raise CommandFailed(f"episode {episode.index} ended at {at_s:.1f} s: {reason}")
    document = {
        "episode": episode.index,
        "tasks": list(episode.tasks),
        "frames": len(episode.actions),
        "duration_s": round(episode.duration_s / arguments.speed, 3),
        "setpoint_error": round(played.setpoint_error, 4),
        "position_error": round(played.position_error, 4),
        "pauses": played.pauses,
    }
    text = (
        f"episode {episode.index} ({', '.join(episode.tasks)}): {len(episode.actions)} frames in "
        f"{document['duration_s']:.1f} s, joints within {played.position_error:.3f} of it"
    )
    return emit(arguments, document, text)


def path_of(
    robot: RobotDescription, episode: "EpisodeActions", unit: Any, speed: float
) -> TimedPath:
    """Return an episode as a path of the robot's joints.

    Raises:
        UsageError: it names others than the robot's joints.
    """
    from vla_deploy.robots.calibration.lerobot_units import units_of

    units = units_of(robot, unit)
    places = {name: row for row, name in enumerate(units.feature_names)}
    strange = [name for name in episode.names if name not in places]
    if strange or len(set(episode.names)) < len(episode.names):
        raise UsageError(
            f"the dataset's actions are {', '.join(episode.names)}; expected those of "
            f"{robot.name}: {', '.join(units.feature_names)}"
        )
    rows = [places[name] for name in episode.names]
    values = np.zeros((len(episode.actions), len(places)))
    values[:, rows] = episode.actions
    return TimedPath(
        joints=tuple(robot.joint_names[row] for row in rows),
        positions=units.to_joints(values)[:, rows],
        frames_per_s=episode.fps * speed,
    )


def within_limits(robot: RobotDescription, path: TimedPath, *, clip: bool) -> TimedPath:
    """Return the path, which is inside of the joints' limits, or is clipped to them.

    Raises:
        UsageError: it leaves them, and is not to be clipped.
    """
    low = np.array([robot.limits[joint].min for joint in path.joints])
    high = np.array([robot.limits[joint].max for joint in path.joints])
    clipped = np.clip(path.positions, low, high)
    beyond = np.abs(path.positions - clipped)
    outside = np.argwhere(beyond > _pulses(robot, path))
    if not len(outside) or clip:
        return replace(path, positions=clipped)
    frame, row = np.unravel_index(int(beyond.argmax()), beyond.shape)
    joints = ", ".join(path.joints[one] for one in sorted({int(one) for _, one in outside}))
    raise UsageError(
        f"frame {frame}: {path.joints[row]} goes to {path.positions[frame, row]:.3f}, expected "
        f"{low[row]:g} to {high[row]:g}; {len({int(one) for one, _ in outside})} frames leave the "
        f"limits ({joints}): take --clip to stay at them, or another --unit or calibration"
    )


def _pulses(robot: RobotDescription, path: TimedPath) -> Floats:
    """Return one pulse of each joint's servo: datasets are rounded, nothing less is beyond."""
    servos = {servo.joint: servo for servo in robot.servo_bus.servos}
    return PULSE_RAD * np.array([servos[joint].travel_per_rad for joint in path.joints])


def require_followable(robot: RobotDescription, path: TimedPath, speed: float) -> None:
    """Check every window as control will, by the same function, before anything moves.

    Raises:
        UsageError: control would refuse one.
    """
    refusal = _refusal(robot, path)
    if not refusal:
        return
    for ratio in _SLOWER:
        slower = replace(path, frames_per_s=path.frames_per_s * ratio)
        if not _refusal(robot, slower):
            raise UsageError(f"{refusal}; at --speed {speed * ratio:.2g} the joints can follow")
    raise UsageError(f"{refusal}; it leaps: no --speed helps")


def tolerance_of(robot: RobotDescription, path: TimedPath) -> Floats:
    """Return how far from the path each of its joints may be where it is taken over."""
    from vla_deploy.control.motion.dispatch import start_tolerance

    found: Floats = start_tolerance(robot)[[robot.joint_index[joint] for joint in path.joints]]
    return found


def _refusal(robot: RobotDescription, path: TimedPath) -> str:
    from vla_deploy.control.motion.trajectory import TrajectoryRefused

    for window in windows_of(path):
        try:
            _judge(robot, window)
        except TrajectoryRefused as error:
            return f"frames {window.begins} to {window.ends} are too fast: {error}"
    return ""


def _judge(robot: RobotDescription, window: PathWindow) -> None:
    from vla_deploy.control.motion.axes import AxesState
    from vla_deploy.control.motion.dispatch import axis_limits, start_tolerance
    from vla_deploy.control.motion.trajectory import plan_trajectory

    path = window.path
    axes = np.array([robot.joint_index[joint] for joint in path.joints])
    velocity = path.velocity_at(window.begins)
    start = AxesState(
        position=path.positions[window.begins],
        velocity=np.zeros_like(velocity) if window.from_rest else velocity,
        acceleration=np.zeros_like(velocity),
    )
    times_s, positions = window.trajectory(None if window.from_rest else window.begins)
    limits = axis_limits(robot).of(axes).scaled(JUDGED_SPEED_RATIO)
    bounds = robot.position_min[axes], robot.position_max[axes]
    tolerance = start_tolerance(robot)[axes]
    plan_trajectory(path.joints, times_s, positions, start, limits, bounds, tolerance)


def _play(session: RobotSession, robot: RobotDescription, path: TimedPath) -> PlayedPath:
    parts = robot.groups_moving(path.joints)
    with attended_motion(session, robot, "cli/joint_play", parts) as attended:
        motions = attended.motions

        def wait() -> None:
            attended.require_wanted()
            session.pause()

        first = dict(zip(path.joints, path.positions[0].tolist(), strict=True))
        grippers = dict.fromkeys(robot.gripper_joints & set(path.joints), GRIPPER_EFFORT_RATIO)
        motion_id = motions.go(first, grippers, APPROACH_SPEED_RATIO)
        while (ended := motions.ended(motion_id)) is None:
            wait()
            motions.step()
        if ended.status != DONE:
            raise CommandFailed(f"the first pose was not reached: {ended.status}, {ended.reason}")
        return PathPlayer(motions, session.clock, path, tolerance_of(robot, path)).play(wait)
