"""Publish what the robot sees and remembers: /detected_objects as JSON, the same with types."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from vla_deploy_msgs.msg import DetectedObject, DetectedObjectArray

from drivers.clock import NS_PER_S
from vla_deploy.gateways.ros.geometry.body_frames import BodyFrames
from vla_deploy.gateways.ros.geometry.planar import planar_of
from vla_deploy.gateways.ros.geometry.points import moved, pixels_of, planar_pose
from vla_deploy.gateways.ros.geometry.rotation import quaternion_of
from vla_deploy.gateways.ros.graph import RELIABLE
from vla_deploy.gateways.ros.json_topic import JsonTopic
from vla_deploy.gateways.ros.outward.body import MAP
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.ipc import topics
from vla_deploy.robots.kinematics.frame_tree import OPTICAL_FRAME

RATE_HZ: Final = 5.0
JSON_TOPIC: Final = "/detected_objects"
TYPED_TOPIC: Final = "/vla_deploy/detected_objects"
_AGE_S: Final = 2.0
_SEEN_NS: Final = 3 * NS_PER_S // 2
"""What was seen last longer before the scene's image is remembered: it has no box."""
_NEAREST_M: Final = 0.1
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0

Floats = NDArray[np.float64]
Thing = Mapping[str, Any]


class SceneObjects:
    """Publish the scene's things whenever perception tells them, while somebody listens."""

    def __init__(self, gateway: Gateway, frames: BodyFrames) -> None:
        self._gateway = gateway
        self._frames = frames
        self._json = JsonTopic(gateway.graph, JSON_TOPIC)
        self._typed = gateway.graph.publisher(DetectedObjectArray, TYPED_TOPIC, RELIABLE)
        self._due = Due(RATE_HZ)
        self._sequence = 0

    def step(self, now_ns: int) -> None:
        """Publish a scene that is new."""
        wants_typed = self._typed.get_subscription_count() > 0
        if not (self._json.is_wanted or wants_typed) or not self._due.is_now(now_ns):
            return
        sample = self._gateway.link.fresh(topics.SCENE, _AGE_S)
        if sample is None or sample.sequence == self._sequence:
            return
        self._sequence = sample.sequence
        scene = sample.document()
        if wants_typed:
            self._typed.publish(self._array(scene, sample.stamp_ns))
        if self._json.is_wanted:
            camera = self._camera_from_map()
            self._json.tell([self._told(one, scene, camera) for one in _known(scene)])

    def stop(self) -> None:
        """Leave nothing under way."""

    def _told(self, thing: Thing, scene: Thing, camera_from_map: Floats | None) -> dict[str, Any]:
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
        pose, joints = link.fresh(topics.POSE, _AGE_S), link.fresh(topics.JOINT_STATE, _AGE_S)
        if pose is None or joints is None:
            return None
        camera = self._frames.poses(np.asarray(joints.data["position"]))[OPTICAL_FRAME]
        map_from_camera = planar_pose(*planar_of(pose)) @ camera
        return np.asarray(np.linalg.inv(map_from_camera), np.float64)

    def _array(self, scene: Thing, stamp_ns: int) -> DetectedObjectArray:
        time = self._gateway.time
        message = DetectedObjectArray()
        message.header.frame_id, message.header.stamp = MAP, time.stamp(stamp_ns)
        for thing in _known(scene):
            one = DetectedObject(
                id=str(thing["id"]),
                class_name=str(thing["class"]),
                colour=str(thing["colour"]),
                confidence=float(thing["confidence"]),
                last_seen=time.stamp(thing["last_seen_ns"]),
                seen_count=int(thing.get("seen_count", 0)),
            )
            position = one.pose.position
            position.x, position.y, position.z = map(float, thing["position_m"])
            one.pose.orientation = quaternion_of(0.0, 0.0, float(thing.get("yaw_rad", 0.0)))
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


def _known(scene: Thing) -> Iterator[Thing]:
    yield from latest_last(scene["objects"])


def _corners(thing: Thing) -> Floats:
    turn = planar_pose(0.0, 0.0, float(thing.get("yaw_rad", 0.0)))
    turn[:3, 3] = thing["position_m"]
    return moved(_CORNERS * thing["size_m"], turn)
