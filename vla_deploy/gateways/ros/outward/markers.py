"""Draw objects, the way and the goals of the plan, for RViz and Foxglove."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from vla_deploy.gateways.ros.conversions import quaternion_of
from vla_deploy.gateways.ros.outward.plan_dialects import ranked_name
from vla_deploy.gateways.ros.outward.scene import Locator
from vla_deploy.gateways.ros.part import MAP, Due, Gateway, GatewayPart
from vla_deploy.ipc import topics

TOPICS: Final = ("/vla_deploy/markers", "/llm_planner/visualization")
RATE_HZ: Final = 2.0
_LIFETIME: Final = Duration(sec=2)
"""What is published no more goes by itself."""
_WAY_Z_M: Final = 0.03
_LABEL_M: Final = 0.06
_RGB: Final[Mapping[str, tuple[float, float, float]]] = {
    "red": (0.8, 0.1, 0.1),
    "green": (0.1, 0.6, 0.2),
    "blue": (0.1, 0.3, 0.8),
    "yellow": (0.9, 0.8, 0.1),
    "orange": (0.9, 0.5, 0.1),
    "purple": (0.5, 0.2, 0.6),
    "brown": (0.5, 0.3, 0.15),
    "white": (0.95, 0.95, 0.95),
    "black": (0.1, 0.1, 0.1),
}
_GREY: Final = (0.6, 0.6, 0.6)
_WAY_COLOUR: Final = ColorRGBA(r=0.1, g=0.7, b=0.9, a=1.0)
_GOAL_COLOUR: Final = ColorRGBA(r=0.95, g=0.6, b=0.1, a=0.9)


class SceneMarkers(GatewayPart):
    """Publish the same markers on both topics, while somebody listens."""

    def __init__(self, gateway: Gateway, locator: Locator) -> None:
        self._gateway = gateway
        self._locator = locator
        self._topics = [gateway.graph.publisher(MarkerArray, topic) for topic in TOPICS]
        self._due = Due(RATE_HZ)

    def step(self, now_ns: int) -> None:
        """Publish what is to be seen now."""
        wanted = [one for one in self._topics if one.get_subscription_count() > 0]
        if not wanted or not self._due.is_now(now_ns):
            return
        markers = [*self._objects(), *self._way(), *self._goals()]
        for number, marker in enumerate(markers):
            marker.id = number
            marker.header.frame_id = MAP
            marker.header.stamp = self._gateway.time.now()
            marker.lifetime = _LIFETIME
        for topic in wanted:
            topic.publish(MarkerArray(markers=markers))

    def _objects(self) -> Iterator[Marker]:
        scene = self._locator.scene() or {}
        for thing in scene.get("objects", ()):
            x_m, y_m, z_m = map(float, thing["position_m"])
            marker = marker_at("objects", Marker.CUBE, _colour(thing), (x_m, y_m, z_m))
            marker.pose.orientation = quaternion_of(float(thing.get("yaw_rad", 0.0)))
            size = marker.scale
            size.x, size.y, size.z = (max(float(one), 0.005) for one in thing["size_m"])
            yield marker
            above = (x_m, y_m, z_m + size.z / 2 + _LABEL_M)
            yield _text(f"{thing['id']} {thing['confidence']:.2f}", above)

    def _way(self) -> Iterator[Marker]:
        executor = self._gateway.link.document(topics.EXECUTOR_STATUS, 1.0)
        way = [] if executor is None else executor["way_m"]
        if len(way) < 2:
            return
        marker = marker_at("way", Marker.LINE_STRIP, _WAY_COLOUR, (0.0, 0.0, 0.0))
        marker.scale.x = 0.04
        marker.points = [Point(x=float(x_m), y=float(y_m), z=_WAY_Z_M) for x_m, y_m in way]
        yield marker

    def _goals(self) -> Iterator[Marker]:
        plan = self._gateway.commands.current
        for number, action in enumerate(plan.actions, start=1):
            where = self._locator.where
            name, given = ranked_name(action["skill"], action["parameters"], where)
            at = given.get("target_position") or where(str(given.get("target_object", "")))
            if at is not None:
                place = (float(at[0]), float(at[1]), float(at[2]))
                marker = marker_at("goals", Marker.SPHERE, _GOAL_COLOUR, place)
                marker.scale.x = marker.scale.y = marker.scale.z = 0.1
                yield marker
                status = plan.statuses.get(action["id"], "")
                yield _text(f"{number} {name} {status}", (place[0], place[1], place[2] + 0.3))


def marker_at(name: str, kind: int, colour: ColorRGBA, at: Sequence[float]) -> Marker:
    """Return a marker that is upright at x, y, z; the rest of it is left to fill in."""
    marker = Marker(ns=name, type=kind, action=Marker.ADD, color=colour)
    position = marker.pose.position
    position.x, position.y, position.z = at
    marker.pose.orientation.w = 1.0
    return marker


def _text(text: str, at: Sequence[float]) -> Marker:
    white = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
    marker = marker_at("labels", Marker.TEXT_VIEW_FACING, white, at)
    marker.scale.z = _LABEL_M
    marker.text = text
    return marker


def _colour(thing: Mapping[str, Any]) -> ColorRGBA:
    red, green, blue = _RGB.get(str(thing["colour"]), _GREY)
    return ColorRGBA(r=red, g=green, b=blue, a=0.85)
