"""Read images of the head's camera with joints and depth, from a running robot or a folder."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import topics
from vla_deploy.ipc.rgbd_image import colours, depths_m
from vla_deploy.perception.camera_tools.board import Image
from vla_deploy.perception.camera_tools.errors import BadImages
from vla_deploy.perception.objects.body_state import JointHistory
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.camera import CameraDescription
from vla_deploy.robots.kinematics.model import full_positions
from vla_deploy.runtime.table_schema import is_number

Array = NDArray[np.float64]
JOINTS_FILE: Final = "joints.json"
# Of a head that turns or shakes, the pose is not known well enough.
_STILL_RAD: Final = 0.002
_STILL_NS: Final = NS_PER_S // 4
_JOINTS_GAP_NS: Final = NS_PER_S // 10
_IMAGE_AGE_S: Final = 2.0
_POLL_NS: Final = NS_PER_S // 50


@dataclass(frozen=True, kw_only=True, eq=False)
class HeadImage:
    """Hold one image; joints (robot file's order) and depth where they are known."""

    name: str
    rgb: Image
    positions: Array | None = None
    depth_m: NDArray[np.float32] | None = None

    def require_size(self, camera: CameraDescription) -> None:
        """Check that the image has the camera's size, for which alone its lens is valid.

        Raises:
            BadImages: it has another size.
        """
        height, width = self.rgb.shape[:2]
        if (width, height) != (camera.width, camera.height):
            raise BadImages(
                f"{self.name}: got {width} x {height} px, expected {camera.width} x "
                f"{camera.height}, the camera's in the robot file; take images at that size, do "
                "not scale them"
            )


def live_images(link: RobotLink, robot: RobotDescription, seconds: float) -> Iterator[HeadImage]:
    """Yield a running robot's images for some time, those taken while its head was still."""
    joints, seen, clock = JointHistory(), -1, link.clock
    end_ns = clock.now_ns() + round(seconds * NS_PER_S)
    while clock.now_ns() < end_ns:
        state = link.fresh(topics.JOINT_STATE)
        if state is not None:
            count = len(robot.joint_names)
            joints.add(state.stamp_ns, np.array(state.data["position"][:count], dtype=np.float64))
        frame = link.frame(topics.RGBD, _IMAGE_AGE_S)
        if frame is not None and frame.sequence != seen:
            seen = frame.sequence
            positions = _still_positions(joints, frame.stamp_ns)
            if positions is not None:
                yield HeadImage(
                    name=f"image {seen}",
                    rgb=colours(frame),
                    positions=positions,
                    depth_m=depths_m(frame),
                )
        clock.sleep_until(clock.now_ns() + _POLL_NS)


def _still_positions(joints: JointHistory, stamp_ns: int) -> Array | None:
    """Return the joints at an image's time, None where they moved before it or are not known."""
    now = joints.at(stamp_ns, _JOINTS_GAP_NS)
    before = joints.at(stamp_ns - _STILL_NS, _JOINTS_GAP_NS)
    if now is None or before is None or float(np.abs(now - before).max()) > _STILL_RAD:
        return None
    return now


def joints_by_image(folder: Path, robot: RobotDescription) -> dict[str, Array]:
    """Return the joints that a folder's `joints.json` gives, by image name; none without it.

    Raises:
        BadImages: the file cannot be used.
    """
    file = folder / JOINTS_FILE
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise BadImages(f"{file}: cannot be read: {error}") from error
    if not isinstance(document, dict):
        raise BadImages(f"{file}: expected a table of image names, got {type(document).__name__}")
    return {name: _positions(file, name, row, robot) for name, row in document.items()}


def _positions(file: Path, name: str, row: object, robot: RobotDescription) -> Array:
    known = robot.joint_index
    named: dict[Any, Any] = row if isinstance(row, dict) else {"": row}
    for joint, value in named.items():
        if joint not in known or not is_number(value):
            raise BadImages(
                f"{file}: {name}: got {joint!r} = {value!r}, expected a joint of the robot and its "
                f"position, such as head_pan = 0.1"
            )
    return full_positions(robot, [(joint, float(value)) for joint, value in named.items()])
