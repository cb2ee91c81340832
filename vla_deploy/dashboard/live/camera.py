"""Send the camera's images with the boxes of what perception has just detected.

An image is encoded once for all clients. Pose and joints are the newest ones, up to 0.1 s younger
than the image: while the head turns, boxes run ahead of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.dashboard.live.message import Binary, LiveMessage, LookTime, binary_message
from vla_deploy.ipc import Frame, SharedSpace, topics
from vla_deploy.ipc.rgbd_image import colours
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.kinematic_tree import KinematicTree
from vla_deploy.robots.kinematics.orientation import yaw_rotation

Array = NDArray[np.float64]

SEEN_NS: Final = 3 * NS_PER_S // 2
"""Objects that were seen longer before the image are remembered, not detected."""
NEAREST_M: Final = 0.1
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0
WIDEST_PX: Final = 640
QUALITY: Final = 80


class Detections:
    """Project the objects of `scene` into images."""

    def __init__(self, space: SharedSpace, robot: RobotDescription, tree: KinematicTree) -> None:
        self._robot = robot
        self._tree = tree
        self._scene = space.cell_reader(topics.SCENE)
        self._pose = space.cell_reader(topics.POSE)
        self._joints = space.cell_reader(topics.JOINT_STATE)

    def in_frame(self, frame: Frame) -> list[dict[str, Any]]:
        """Return the detections in an image: names, confidence, and boxes in its pixels."""
        scene, camera = self._scene.latest(), self._camera_from_map()
        if scene is None or camera is None:
            return []
        document = scene.document()
        found = []
        for thing, corners in _cuboids(document, frame.stamp_ns):
            box = self._box(corners @ camera[:3, :3].T + camera[:3, 3], frame)
            if box is not None:
                found.append({**thing, "box": box})
        return found

    def _camera_from_map(self) -> Array | None:
        pose, joints = self._pose.latest(), self._joints.latest()
        if pose is None or joints is None:
            return None
        values = dict(zip(self._robot.joint_names, joints.data["position"].tolist(), strict=False))
        camera = self._robot.camera
        base_from_camera = self._tree.site_pose(camera.site, values) @ camera.site_from_camera
        x_m, y_m, yaw_rad = (float(pose.data[name]) for name in ("x_m", "y_m", "yaw_rad"))
        map_from_base = np.eye(4)
        map_from_base[:3, :3] = yaw_rotation(yaw_rad)
        map_from_base[:2, 3] = x_m, y_m
        inverse: Array = np.asarray(np.linalg.inv(map_from_base @ base_from_camera), np.float64)
        return inverse

    def _box(self, corners: Array, frame: Frame) -> list[float] | None:
        """Return left, top, right, bottom within the image; None for what is outside."""
        if corners[:, 2].min() < NEAREST_M:
            return None
        pixels = project(self._robot.camera.intrinsics, corners)
        size = (frame.width, frame.height)
        low, high = np.clip(pixels.min(axis=0), 0, size), np.clip(pixels.max(axis=0), 0, size)
        if (high - low).min() < 1.0:
            return None
        return [round(float(value), 1) for value in (*low, *high)]


def _cuboids(scene: Mapping[str, Any], stamp_ns: int) -> Iterator[tuple[dict[str, Any], Array]]:
    """Yield what was seen at the image's time, and the corners of its cuboid in the map."""
    for thing in scene.get("objects", ()):
        if abs(stamp_ns - thing["last_seen_ns"]) <= SEEN_NS:
            names = {key: thing[key] for key in ("id", "class", "colour", "confidence")}
            turned = _CORNERS * thing["size_m"] @ yaw_rotation(thing.get("yaw_rad", 0.0)).T
            yield names, turned + thing["position_m"]
    if abs(stamp_ns - scene.get("stamp_ns", 0)) > SEEN_NS:
        return
    for one in scene.get("bystanders", ()):
        names = {"id": None, "colour": "", "class": one["class"], "confidence": one["confidence"]}
        yield names, _standing(one["position_m"], one["width_m"], one["top_m"])


def _standing(position_m: Sequence[float], width_m: float, top_m: float) -> Array:
    corners: Array = _CORNERS * (width_m, width_m, top_m)
    middle: Array = np.array((position_m[0], position_m[1], top_m / 2))
    return corners + middle


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraImage:
    """Hold a JPEG and its header; boxes are in its pixels."""

    jpeg: bytes
    stamp_ns: int
    header: Mapping[str, Any]


class CameraFeed:
    """Publish the live topic "camera", and return the newest image on request."""

    topic = "camera"
    period_s = 0.2

    def __init__(self, space: SharedSpace, detections: Detections) -> None:
        self._pulse = space.pulse_reader(topics.RGBD)
        self._frames = space.frame_reader(topics.RGBD)
        self._detections = detections
        self._picture: CameraImage | None = None
        self._sequence = 0
        self._sent = 0

    def begin(self) -> None:
        """Send the newest image again."""
        self._sent = 0

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return the image, if it is new."""
        picture = self.newest()
        if picture is None or self._sequence == self._sent:
            return ()
        self._sent = self._sequence
        times = {
            "stamp_s": round(now.wall_s(picture.stamp_ns), 4),
            "age_s": round(now.age_s(picture.stamp_ns), 4),
        }
        header = {"topic": self.topic, **times, **picture.header}
        return (binary_message(self.topic, Binary.CAMERA_JPEG, header, picture.jpeg),)

    def newest(self) -> CameraImage | None:
        """Return the newest image, None before the first; each is encoded once.

        Raises:
            BadPayload: the frame's size contradicts its header.
        """
        beat = self._pulse.latest()
        if beat is not None and beat.sequence != self._sequence:
            frame = self._frames.latest()
            if frame is not None:
                self._picture, self._sequence = self._encoded(frame), frame.sequence
        return self._picture

    def _encoded(self, frame: Frame) -> CameraImage:
        image, ratio = _shrunk(colours(frame))
        _, jpeg = cv2.imencode(".jpg", image[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
        found = self._detections.in_frame(frame)
        for one in found:
            one["box"] = [round(value * ratio, 1) for value in one["box"]]
        height, width = image.shape[:2]
        header = {"width": width, "height": height, "detections": found}
        return CameraImage(jpeg=jpeg.tobytes(), stamp_ns=frame.stamp_ns, header=header)


def _shrunk(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], float]:
    """Return an image no wider than `WIDEST_PX`, and the scale."""
    ratio = min(1.0, WIDEST_PX / image.shape[1])
    if ratio == 1.0:
        return image, ratio
    size = (round(image.shape[1] * ratio), round(image.shape[0] * ratio))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8), ratio
