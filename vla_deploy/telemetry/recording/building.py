"""Put the rolling recorder of a run together, as `recording.toml` wants it."""

import logging
from collections.abc import Callable
from concurrent.futures import Executor
from typing import Final

from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.errors import SettingsInvalid
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.recorder import RollingRecorder
from vla_deploy.telemetry.recording.recording_file import RecordedRun
from vla_deploy.telemetry.recording.request import RecordingWish
from vla_deploy.telemetry.recording.settings import RecordingSettings, read_settings
from vla_deploy.telemetry.recording.tape import FileLimits, Tape

_log = logging.getLogger(__name__)

WRITING_S: Final = 0.02
"""What writing a step's batch takes, of simulated time: less than the period of the steps."""


def rolling_recorder(
    context: NodeContext,
    space: SharedSpace,
    wall_ns: Callable[[], int],
    *,
    settings: RecordingSettings | None = None,
    folder: RecordingFolder | None = None,
    executor: Executor | None = None,
) -> RollingRecorder:
    """Return the recorder of a run; what is not given comes from the run's own folders.

    Settings with faults are told, and leave the defaults in force: flights matter more.
    """
    base = context.run_dir.parent
    chosen = settings or _settings(context)
    place = folder or RecordingFolder(recordings_dir_of(base), chosen.bounds)
    run = RecordedRun(
        run_id=context.run_dir.resolve().name, robot=context.robot, profile=context.profile
    )
    limits = FileLimits(size_bytes=round(chosen.file_mb * 1e6), duration_s=chosen.file_s)

    def new_tape(wish: RecordingWish) -> Tape:
        return Tape(place, run, wish, limits, context.clock, wall_ns)

    def new_collector(wish: RecordingWish) -> Collector:
        logs = context.run_dir / LOGS_DIR
        return Collector(space, logs, wish.selection, chosen.image_period_s)

    return RollingRecorder(
        space,
        context.clock,
        new_tape=new_tape,
        new_collector=new_collector,
        executor=executor or low_priority_thread(context.clock, WRITING_S),
        always=chosen.wish if chosen.always else None,
    )


def _settings(context: NodeContext) -> RecordingSettings:
    try:
        return read_settings(context.run_dir.parent).recording
    except SettingsInvalid as error:
        _log.error("degraded: recording goes by its defaults: %s", error)
        return RecordingSettings()
