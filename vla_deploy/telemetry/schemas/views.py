"""Draw the views of a run: one table from topics to messages in Foxglove's schemas."""

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.layout import is_document, record_dtype
from vla_deploy.navigation.errors import NavigationError
from vla_deploy.robots import RobotDescription
from vla_deploy.telemetry.channels import Channel
from vla_deploy.telemetry.schemas import robot_views, scene_views
from vla_deploy.telemetry.schemas.foxglove_json import Json, foxglove_schema
from vla_deploy.telemetry.schemas.robot_views import RobotViews


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicView:
    """Draw a topic's values on a channel of its own, at most one every `period_s`.

    `draw` takes the packed record or the document, and the value's stamp in wall clock.
    """

    channel: str
    schema_name: str
    topic: str
    draw: Callable[[RobotViews, Any, int], Json]
    period_s: float = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
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
    TopicView(
        channel="view/joints",
        schema_name="foxglove.JointStates",
        topic="joint_state",
        draw=RobotViews.joints,
    ),
    TopicView(
        channel="view/frames",
        schema_name="foxglove.FrameTransforms",
        topic="joint_state",
        draw=RobotViews.frames,
    ),
    TopicView(
        channel="view/base_frame",
        schema_name="foxglove.FrameTransforms",
        topic="pose",
        draw=_plain(robot_views.base_frame),
    ),
    TopicView(
        channel="view/pose",
        schema_name="foxglove.PoseInFrame",
        topic="pose",
        draw=_plain(robot_views.pose),
    ),
    TopicView(
        channel="view/odometry",
        schema_name="foxglove.Odometry",
        topic="base_state",
        draw=_plain(robot_views.odometry),
    ),
    TopicView(
        channel="view/scan",
        schema_name="foxglove.LaserScan",
        topic="scan",
        draw=RobotViews.scan,
    ),
    TopicView(
        channel="view/near_obstacles",
        schema_name="foxglove.PointCloud",
        topic="near_obstacles",
        draw=_plain(robot_views.obstacles),
        period_s=0.2,
    ),
    TopicView(
        channel="view/scene",
        schema_name="foxglove.SceneUpdate",
        topic="scene",
        draw=_plain(scene_views.scene),
        period_s=0.5,
    ),
)

CONSTANT_VIEWS: Final[tuple[ConstantView, ...]] = (
    ConstantView(channel="view/map", schema_name="foxglove.Grid", draw=scene_views.home_map),
    ConstantView(channel="view/zones", schema_name="foxglove.SceneUpdate", draw=scene_views.zones),
    ConstantView(
        channel="view/lens", schema_name="foxglove.CameraCalibration", draw=robot_views.lens
    ),
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
        """Yield channel and JSON of the constant views, leaving out a map that cannot be read."""
        for one in CONSTANT_VIEWS:
            if not wanted(one.channel):
                continue
            try:
                yield one.channel, _text(one.draw(self._robot, stamp_ns))
            except NavigationError as error:
                _log.warning("degraded: no %s: %s", one.channel, error)

    def _is_due(self, view: TopicView, stamp_ns: int) -> bool:
        """Return whether a view is due; after a clock was set back, every view is."""
        elapsed_ns = stamp_ns - self._drawn_ns.get(view.channel, -NS_PER_S)
        return not 0 <= elapsed_ns < round(view.period_s * NS_PER_S)


def _text(drawn: object) -> bytes:
    return json.dumps(drawn, separators=(",", ":"), allow_nan=False).encode()
