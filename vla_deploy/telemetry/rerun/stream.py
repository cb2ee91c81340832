"""Log entities by Rerun's library: into a file, or to a viewer."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.errors import ExtraMissing
from vla_deploy.telemetry.rerun.entity import LOGS, PLOTS, WORLD, Entity
from vla_deploy.telemetry.rerun.plots import JOINT_TOPIC
from vla_deploy.telemetry.rerun.viewer import PORT, url_of

APPLICATION: Final = "vla_deploy"
TIME: Final = "robot_time"
TICK: Final = "tick"
_FLUSH_S: Final = 10.0
_CURVES: Final = (
    f"{JOINT_TOPIC}/position",
    f"{JOINT_TOPIC}/effort_ratio",
    "base_state",
    f"{TICKS}/period_s",
)


class RerunStream:
    """Log to Rerun on two timelines: wall clock, and control's tick where it is known."""

    def __init__(self, name: str) -> None:
        """Begin a recording of that name.

        Raises:
            ExtraMissing: rerun-sdk is not installed.
        """
        self._rerun = rerun = _library()
        rerun.set_strict_mode(True)  # else a bad value is a warning on stderr, and not counted
        self._stream = rerun.RecordingStream(APPLICATION)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._stream.send_recording_name(name)

    def save(self, path: Path) -> None:
        """Write all that follows into a file.

        Raises:
            ExtraMissing: it cannot be written.
        """
        try:
            self._stream.save(path, default_blueprint=_layout())
        except (OSError, RuntimeError) as error:
            raise ExtraMissing(f"{path}: {error}; name another file with --save") from error

    def connect(self, url: str) -> None:
        """Send all that follows to a viewer.

        Raises:
            ExtraMissing: it is no such address, or no viewer is there.
        """
        try:
            self._stream.connect_grpc(url, default_blueprint=_layout())
        except (ValueError, RuntimeError) as error:
            raise ExtraMissing(
                f"rerun: {url}: {error}; expected an address such as {url_of(PORT)}"
            ) from error
        self.flush()

    def at(self, stamp_ns: int, tick: int | None) -> None:
        """Set the time of what is logged next; `stamp_ns` is wall clock.

        Raises:
            ValueError: the time is out of range.
            OverflowError: as above.
        """
        self._stream.set_time(TIME, timestamp=np.datetime64(stamp_ns, "ns"))
        if tick is None:
            self._stream.disable_timeline(TICK)
        else:
            self._stream.set_time(TICK, sequence=tick)

    def log(self, entity: Entity) -> None:
        """Log one entity at the moment that was set.

        Raises:
            ValueError: the archetype does not take such values.
            TypeError: as above.
        """
        values = _CONVERTERS.get(entity.archetype, _unchanged)(self._rerun, entity.values)
        made = getattr(self._rerun, entity.archetype)(**values)
        self._stream.log(entity.path, made, static=entity.static)

    def flush(self) -> None:
        """Wait until everything is written or sent.

        Raises:
            ExtraMissing: it cannot be.
        """
        try:
            self._stream.flush(timeout_sec=_FLUSH_S)
        except RuntimeError as error:
            raise ExtraMissing(f"rerun: {error}; is the viewer open?") from error

    def close(self) -> None:
        """End the recording, and finish the file if there is one."""
        self._stream.disconnect()


def _layout() -> Any:
    """Return the arrangement of the viewer's window: world and logs, and the first curves."""
    from rerun import blueprint

    curves = [blueprint.TimeSeriesView(origin=f"{PLOTS}/{one}", name=one) for one in _CURVES]
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Vertical(
                blueprint.Spatial3DView(origin=WORLD, name=WORLD),
                blueprint.TextLogView(origin=LOGS, name=LOGS),
                row_shares=[3, 1],
            ),
            blueprint.Vertical(*curves),
            column_shares=[3, 2],
        )
    )


def _library() -> Any:
    """Return Rerun's library.

    Raises:
        ExtraMissing: it is not installed.
    """
    os.environ.setdefault("RUST_LOG", "off")  # what it prints on stderr, it raises as well
    try:
        import rerun
    except ImportError as error:
        raise ExtraMissing(
            "Rerun needs rerun-sdk, which is not installed: pip install 'vla-deploy[rerun]'"
        ) from error
    return rerun


def _unchanged(_: Any, values: Mapping[str, Any]) -> Mapping[str, Any]:
    return values


def _grid_map(rerun: Any, values: Mapping[str, Any]) -> Mapping[str, Any]:
    return {**values, "format": rerun.components.ImageFormat(**values["format"])}


# Archetypes that need more than numbers and texts.
_CONVERTERS: Final[Mapping[str, Callable[[Any, Mapping[str, Any]], Mapping[str, Any]]]] = {
    "GridMap": _grid_map,
}
