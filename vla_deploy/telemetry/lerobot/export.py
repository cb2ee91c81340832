"""Write recordings as one LeRobot dataset."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.lerobot_units import LeRobotUnit, units_of
from vla_deploy.telemetry.errors import DatasetRefused
from vla_deploy.telemetry.lerobot.layout import ROBOT_TYPES
from vla_deploy.telemetry.lerobot.recorded_episodes import (
    RecordedEpisode,
    cameras_of,
    frames_of,
    spoken_episodes,
    whole_recording,
)
from vla_deploy.telemetry.lerobot.writer import DatasetWriter
from vla_deploy.telemetry.recorded_file import RecordedFile


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetRequest:
    """Say what is to be written; without a `task` each command in words is an episode."""

    fps: int
    unit: LeRobotUnit = LeRobotUnit.DEGREES
    task: str | None = None
    with_failed: bool = False
    with_images: bool = True
    robot: str | None = None
    """Its folder, where it is not the one that the recordings name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenDataset:
    """Say what was written."""

    episodes: int
    frames: int
    tasks: tuple[str, ...]
    cameras: tuple[str, ...]


def export(files: Sequence[RecordedFile], root: Path, request: DatasetRequest) -> WrittenDataset:
    """Write the episodes of some recordings into a new folder, in their order.

    Raises:
        DatasetRefused: there is no episode, recordings do not fit together, or values are missing.
        ExtraMissing: the extra is not installed.
        FlightUnreadable: a file is spoiled.
        RobotError: the robot's files cannot be used.
    """
    robots = sorted({file.robot for file in files})
    if len(robots) > 1 and request.robot is None:
        raise DatasetRefused(f"recordings of {', '.join(robots)}: expected those of one robot")
    robot = load_robot(request.robot or robots[0])
    units = units_of(robot, request.unit)
    cameras = _common_cameras(files) if request.with_images else ()
    found = [(file, episode) for file in files for episode in _episodes(file, request)]
    if not found:
        raise DatasetRefused(
            f"{', '.join(file.path.name for file in files)}: no command in words has been carried "
            "out in there; say what was done with --task, or take failed ones with --with-failed"
        )
    with DatasetWriter(
        root,
        names=units.feature_names,
        cameras=cameras,
        fps=request.fps,
        robot_type=ROBOT_TYPES.get(robot.name, robot.name),
    ) as writer:
        for file, episode in found:
            frames = frames_of(
                file, episode, joints=len(robot.joint_names), cameras=cameras, fps=request.fps
            )
            for frame in frames:
                writer.add_frame(
                    units.to_lerobot(frame.state), units.to_lerobot(frame.action), frame.images
                )
            writer.end_episode(episode.task)
    return WrittenDataset(
        episodes=writer.episodes,
        frames=writer.frames,
        tasks=tuple(dict.fromkeys(episode.task for _, episode in found)),
        cameras=cameras,
    )


def _episodes(file: RecordedFile, request: DatasetRequest) -> list[RecordedEpisode]:
    if request.task is not None:
        return [whole_recording(file, request.task)]
    return spoken_episodes(file, with_failed=request.with_failed)


def _common_cameras(files: Sequence[RecordedFile]) -> tuple[str, ...]:
    """Return the cameras of all recordings.

    Raises:
        DatasetRefused: they do not have the same.
    """
    by_file = {file.path.name: cameras_of(file) for file in files}
    if len(set(by_file.values())) > 1:
        listed = "; ".join(f"{name}: {', '.join(has) or 'none'}" for name, has in by_file.items())
        raise DatasetRefused(
            f"recordings with different cameras ({listed}): export them apart, or --without-images"
        )
    return next(iter(by_file.values()))
