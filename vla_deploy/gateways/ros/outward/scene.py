"""Find where places and things are, and publish what the robot sees and remembers.

/detected_objects has it as JSON, /vla_deploy/detected_objects with types.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from vla_deploy_msgs.msg import DetectedObject, DetectedObjectArray

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.ros.conversions import fill_pose
from vla_deploy.gateways.ros.geometry import (
    BodyFrames,
    Floats,
    moved,
    pixels_of,
    pose_of,
    standing,
)
from vla_deploy.gateways.ros.graph import JsonTopic
from vla_deploy.gateways.ros.part import MAP, Due, Gateway, GatewayPart
from vla_deploy.ipc import topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.frame_tree import OPTICAL_FRAME
from vla_deploy.world import (
    SceneUnreadable,
    Snapshot,
    UnknownWord,
    find,
    parse_query,
    read_snapshot,
)

SCENE_AGE_S: Final = 2.0
NEAR_M: Final = 1.5
"""How near a named place must be to say that the robot is there."""
RATE_HZ: Final = 5.0
JSON_TOPIC: Final = "/detected_objects"
TYPED_TOPIC: Final = "/vla_deploy/detected_objects"
_SEEN_NS: Final = 3 * NS_PER_S // 2
"""What was seen last longer before the scene's image is remembered: it has no box."""
_NEAREST_M: Final = 0.1
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0

Thing = Mapping[str, Any]


class Locator:
    """Look things up in the scene, and places in the robot file."""

    def __init__(self, link: RobotLink, robot: RobotDescription) -> None:
        self._link = link
        self._places = {
            name.lower().replace("_", " "): place
            for place in robot.home.places.values()
            for name in (place.name, *place.aliases)
        }

    def where(self, name: str) -> Sequence[float] | None:
        """Return x, y, z of a place or of the best known thing of that name, else None."""
        place = self._places.get(name.lower().replace("_", " "))
        if place is not None:
            return (place.pose.x_m, place.pose.y_m, 0.0)
        snapshot = self.snapshot()
        if snapshot is None or not name:
            return None
        try:
            found = find(parse_query(name), snapshot)
        except UnknownWord:
            return None  # words that the scene has no thing for: their place is not known
        return found[0].position_m if found else None

    def snapshot(self) -> Snapshot | None:
        """Return the scene, None where perception is silent or the document is another."""
        document = self.scene()
        try:
            return None if document is None else read_snapshot(document)
        except SceneUnreadable:
            return None

    def scene(self) -> Mapping[str, Any] | None:
        """Return the scene's document, None where perception is silent."""
        return self._link.document(topics.SCENE, SCENE_AGE_S)

    def place_at(self, x_m: float, y_m: float) -> str:
        """Return the named place that is nearest, "" where none is near."""
        distances = {
            place.name: ((place.pose.x_m - x_m) ** 2 + (place.pose.y_m - y_m) ** 2) ** 0.5
            for place in self._places.values()
        }
        nearest = min(distances, key=lambda name: distances[name], default="")
        return nearest if nearest and distances[nearest] <= NEAR_M else ""

    def places(self) -> dict[str, list[float]]:
        """Return every place by its name: x, y in m, yaw in rad."""
        return {
            place.name: [place.pose.x_m, place.pose.y_m, place.pose.yaw_rad]
            for place in self._places.values()
        }


class SceneObjects(GatewayPart):
    """Publish the scene's things, each scene once, while somebody listens."""

    def __init__(self, gateway: Gateway, frames: BodyFrames) -> None:
        self._gateway = gateway
        self._frames = frames
        self._json = JsonTopic(gateway.graph, JSON_TOPIC)
        self._typed = gateway.graph.publisher(DetectedObjectArray, TYPED_TOPIC)
        self._due = Due(RATE_HZ)
        self._sequence = 0

    def step(self, now_ns: int) -> None:
        """Publish a scene that is new."""
        wants_typed = self._typed.get_subscription_count() > 0
        if not (self._json.is_wanted or wants_typed) or not self._due.is_now(now_ns):
            return
        sample = self._gateway.link.fresh(topics.SCENE, SCENE_AGE_S)
        if sample is None or sample.sequence == self._sequence:
            return
        self._sequence = sample.sequence
        scene = sample.document()
        if wants_typed:
            self._typed.publish(self._array(scene, sample.stamp_ns))
        if self._json.is_wanted:
            camera = self._camera_from_map()
            self._json.publish(
                [self._described(one, scene, camera) for one in latest_last(scene["objects"])]
            )

    def _described(
        self, thing: Thing, scene: Thing, camera_from_map: Floats | None
    ) -> dict[str, Any]:
        seen = scene["stamp_ns"] - thing["last_seen_ns"] <= _SEEN_NS
        box = None
        if camera_from_map is not None and seen:
            box = self._box(moved(_corners(thing), camera_from_map))
        return {
            **described(thing),
            "size": list(thing.get("size_m", ())),
            "bbox": box,
            "last_seen": round((scene["stamp_ns"] - thing["last_seen_ns"]) / NS_PER_S, 2),
        }

    def _box(self, corners: Floats) -> list[int] | None:
        """Return left, top, right, bottom in the image's pixels; None for what is not in it."""
        lens = self._gateway.robot.camera.intrinsics
        if corners[:, 2].min() < _NEAREST_M:
            return None
        pixels, size = pixels_of(corners, lens), (lens.width, lens.height)
        low, high = np.clip(pixels.min(axis=0), 0, size), np.clip(pixels.max(axis=0), 0, size)
        return None if (high - low).min() < 1.0 else [round(float(v)) for v in (*low, *high)]

    def _camera_from_map(self) -> Floats | None:
        link = self._gateway.link
        pose, joints = (
            link.fresh(topics.POSE, SCENE_AGE_S),
            link.fresh(topics.JOINT_STATE, SCENE_AGE_S),
        )
        if pose is None or joints is None:
            return None
        camera = self._frames.poses(np.asarray(joints.data["position"]))[OPTICAL_FRAME]
        map_from_camera = standing(pose_of(pose)) @ camera
        return np.asarray(np.linalg.inv(map_from_camera), np.float64)

    def _array(self, scene: Thing, stamp_ns: int) -> DetectedObjectArray:
        time = self._gateway.time
        message = DetectedObjectArray()
        message.header.frame_id, message.header.stamp = MAP, time.stamp(stamp_ns)
        for thing in latest_last(scene["objects"]):
            one = DetectedObject(
                id=str(thing["id"]),
                class_name=str(thing["class"]),
                colour=str(thing["colour"]),
                confidence=float(thing["confidence"]),
                last_seen=time.stamp(thing["last_seen_ns"]),
                seen_count=int(thing.get("seen_count", 0)),
            )
            x_m, y_m, z_m = map(float, thing["position_m"])
            fill_pose(one.pose, Pose2D(x_m, y_m, float(thing.get("yaw_rad", 0.0))), z_m)
            one.size.x, one.size.y, one.size.z = map(float, thing["size_m"])
            message.objects.append(one)
        return message


def described(thing: Thing) -> dict[str, Any]:
    """Return how JSON topics describe a thing; its position is x, y, z in m of the map."""
    colour, kind = str(thing["colour"]), str(thing["class"])
    return {
        "id": thing["id"],
        "name": thing["id"],
        "class": kind,
        "color": colour,
        "description": f"{colour} {kind}".strip(),
        "position": list(thing["position_m"]),
        "confidence": thing["confidence"],
    }


def latest_last(things: Sequence[Thing]) -> list[Thing]:
    """Return things in the order in which they were seen, the newest last."""
    return sorted(things, key=lambda one: int(one.get("last_seen_ns", 0)))


def _corners(thing: Thing) -> Floats:
    turn = standing(Pose2D(0.0, 0.0, float(thing.get("yaw_rad", 0.0))))
    turn[:3, 3] = thing["position_m"]
    return moved(_CORNERS * thing["size_m"], turn)
