"""Draw the views of a run: one table from topics to messages in Foxglove's schemas."""

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.errors import MapInvalid, PartMissing
from vla_deploy.telemetry.channels import Channel
from vla_deploy.telemetry.schemas import robot_views, scene_views
from vla_deploy.telemetry.schemas.foxglove_json import Json, foxglove_schema
from vla_deploy.telemetry.schemas.robot_views import RobotViews


@dataclass(frozen=True, slots=True)
class TopicView:
    """Draw a topic's values on a channel of its own, at most one every `period_s`.

    `draw` takes the packed record or the document, and the value's stamp in wall clock.
    """

    channel: str
    schema_name: str
    topic: str
    draw: Callable[[RobotViews, Any, int], Json]
    period_s: float = 0.1


@dataclass(frozen=True, slots=True)
class ConstantView:
    """Draw what does not change while the robot runs."""

    channel: str
    schema_name: str
    draw: Callable[[RobotDescription, int], Json]


def _plain(draw: Callable[[Any, int], Json]) -> Callable[[RobotViews, Any, int], Json]:
    """Return a drawing that needs no kinematics in the form of the others."""
    return lambda _, value, stamp_ns: draw(value, stamp_ns)


LOG: Final = "view/log"
LOG_SCHEMA: Final = "foxglove.Log"

VIEWS: Final[tuple[TopicView, ...]] = (
    TopicView("view/joints", "foxglove.JointStates", "joint_state", RobotViews.joints),
    TopicView("view/frames", "foxglove.FrameTransforms", "joint_state", RobotViews.frames),
    TopicView(
        "view/base_frame", "foxglove.FrameTransforms", "pose", _plain(robot_views.base_frame)
    ),
    TopicView("view/pose", "foxglove.PoseInFrame", "pose", _plain(robot_views.pose)),
    TopicView("view/odometry", "foxglove.Odometry", "base_state", _plain(robot_views.odometry)),
    TopicView("view/scan", "foxglove.LaserScan", "scan", RobotViews.scan),
    TopicView(
        "view/near_obstacles",
        "foxglove.PointCloud",
        "near_obstacles",
        _plain(robot_views.obstacles),
        period_s=0.2,
    ),
    TopicView(
        "view/scene", "foxglove.SceneUpdate", "scene", _plain(scene_views.scene), period_s=0.5
    ),
)

CONSTANT_VIEWS: Final[tuple[ConstantView, ...]] = (
    ConstantView("view/map", "foxglove.Grid", scene_views.home_map),
    ConstantView("view/zones", "foxglove.SceneUpdate", scene_views.zones),
    ConstantView("view/lens", "foxglove.CameraCalibration", robot_views.lens),
)


def _channel(name: str, schema_name: str) -> Channel:
    return Channel(topic=name, schema_name=schema_name, schema=foxglove_schema(schema_name))


CHANNELS: Final[tuple[Channel, ...]] = (
    *(_channel(view.channel, view.schema_name) for view in VIEWS),
    *(_channel(view.channel, view.schema_name) for view in CONSTANT_VIEWS),
    _channel(LOG, LOG_SCHEMA),
)
"""The channels of all views, beyond those of the topics themselves."""

Wanted = Callable[[str], bool]
VIEWS_BY_TOPIC: Final[Mapping[str, tuple[TopicView, ...]]] = {
    topic: tuple(view for view in VIEWS if view.topic == topic)
    for topic in {view.topic for view in VIEWS}
}
_log = logging.getLogger(__name__)


class ViewDrawer:
    """Draw the wanted views for one reader, each at its own rate."""

    def __init__(self, robot: RobotDescription) -> None:
        """Build the robot's kinematics.

        Raises:
            RobotFileError: pinocchio does not find the robot file's joints in the MJCF.
        """
        self._robot = robot
        self._views = RobotViews(robot)
        self._drawn_ns: dict[str, int] = {}

    def views_of(
        self, topic: str, payload: bytes, stamp_ns: int, wanted: Wanted
    ) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the views of one value; `stamp_ns` is wall clock."""
        due = [view for view in VIEWS_BY_TOPIC.get(topic, ()) if self._is_due(view, stamp_ns)]
        due = [view for view in due if wanted(view.channel)]
        if not due:
            return
        declared = BY_NAME[topic]
        value = (
            json.loads(payload)
            if is_document(declared)
            else np.frombuffer(payload, record_dtype(declared))[0]
        )
        for view in due:
            self._drawn_ns[view.channel] = stamp_ns
            yield view.channel, _text(view.draw(self._views, value, stamp_ns))

    def constant_views(self, stamp_ns: int, wanted: Wanted) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the constant views that there are and that can be drawn."""
        for one in CONSTANT_VIEWS:
            if not wanted(one.channel):
                continue
            try:
                yield one.channel, _text(one.draw(self._robot, stamp_ns))
            except PartMissing:
                continue  # there is nothing to draw
            except MapInvalid as error:
                _log.warning("degraded: no %s: %s", one.channel, error)

    def _is_due(self, view: TopicView, stamp_ns: int) -> bool:
        """Return whether a view is due; after a clock was set back, every view is."""
        elapsed_ns = stamp_ns - self._drawn_ns.get(view.channel, -NS_PER_S)
        return not 0 <= elapsed_ns < round(view.period_s * NS_PER_S)


def _text(drawn: object) -> bytes:
    return json.dumps(drawn, separators=(",", ":"), allow_nan=False).encode()
