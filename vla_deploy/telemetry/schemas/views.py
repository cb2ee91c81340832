"""List what viewers are shown: one table, from a topic of the schema table to a known schema."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.robots import RobotDescription
from vla_deploy.telemetry.channels import Channel
from vla_deploy.telemetry.schemas import home_views, robot_views, scene_views
from vla_deploy.telemetry.schemas.geometry import Json
from vla_deploy.telemetry.schemas.robot_views import RobotViews
from vla_deploy.telemetry.schemas.well_known import well_known


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Show a topic's values on a channel of its own, at most one every `period_s`.

    `draw` gets the packed record or the document, and the value's wall-clock stamp.
    """

    channel: str
    schema_name: str
    topic: str
    draw: Callable[[RobotViews, Any, int], Json]
    period_s: float = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class StillView:
    """Show what stays as it is while the robot runs."""

    channel: str
    schema_name: str
    draw: Callable[[RobotDescription, int], Json]


LOG: Final = "view/log"
LOG_SCHEMA: Final = "foxglove.Log"

VIEWS: Final[tuple[View, ...]] = (
    View(
        channel="view/joints",
        schema_name="foxglove.JointStates",
        topic="joint_state",
        draw=RobotViews.joints,
    ),
    View(
        channel="view/frames",
        schema_name="foxglove.FrameTransforms",
        topic="joint_state",
        draw=RobotViews.frames,
    ),
    View(
        channel="view/base_frame",
        schema_name="foxglove.FrameTransforms",
        topic="pose",
        draw=lambda _, value, stamp_ns: robot_views.base_frame(value, stamp_ns),
    ),
    View(
        channel="view/pose",
        schema_name="foxglove.PoseInFrame",
        topic="pose",
        draw=lambda _, value, stamp_ns: robot_views.pose(value, stamp_ns),
    ),
    View(
        channel="view/odometry",
        schema_name="foxglove.Odometry",
        topic="base_state",
        draw=lambda _, value, stamp_ns: robot_views.odometry(value, stamp_ns),
    ),
    View(
        channel="view/scan",
        schema_name="foxglove.LaserScan",
        topic="scan",
        draw=RobotViews.scan,
    ),
    View(
        channel="view/near_obstacles",
        schema_name="foxglove.PointCloud",
        topic="near_obstacles",
        draw=lambda _, value, stamp_ns: robot_views.obstacles(value, stamp_ns),
        period_s=0.2,
    ),
    View(
        channel="view/scene",
        schema_name="foxglove.SceneUpdate",
        topic="scene",
        draw=lambda _, value, stamp_ns: scene_views.scene(value, stamp_ns),
        period_s=0.5,
    ),
)

STILL: Final[tuple[StillView, ...]] = (
    StillView(channel="view/map", schema_name="foxglove.Grid", draw=home_views.home_map),
    StillView(channel="view/zones", schema_name="foxglove.SceneUpdate", draw=scene_views.zones),
    StillView(channel="view/lens", schema_name="foxglove.CameraCalibration", draw=home_views.lens),
)


def _channel(name: str, schema_name: str) -> Channel:
    return Channel(topic=name, schema_name=schema_name, schema=well_known(schema_name))


CHANNELS: Final[tuple[Channel, ...]] = (
    *(_channel(view.channel, view.schema_name) for view in VIEWS),
    *(_channel(still.channel, still.schema_name) for still in STILL),
    _channel(LOG, LOG_SCHEMA),
)
"""What the views add to the channels of the topics themselves."""
