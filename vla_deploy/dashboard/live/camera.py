"""Bring the camera's pictures to clients: encoded once, no wider than a page shows them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.dashboard.live.detections import Detections
from vla_deploy.dashboard.live.message import Binary, Message, Moment, binary_message
from vla_deploy.ipc import Frame, SharedSpace
from vla_deploy.ipc.rgbd_image import colours

WIDEST_PX: Final = 640
QUALITY: Final = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """Hold a JPEG and what is told with it; boxes are in its pixels."""

    jpeg: bytes
    stamp_ns: int
    header: Mapping[str, Any]


class CameraFeed:
    """Be the live topic "camera", and give the newest picture to whoever asks."""

    topic = "camera"
    period_s = 0.2

    def __init__(self, space: SharedSpace, detections: Detections) -> None:
        self._pulse = space.pulse_reader("rgbd")
        self._frames = space.frame_reader("rgbd")
        self._detections = detections
        self._picture: Picture | None = None
        self._sequence = 0
        self._told = 0

    def begin(self) -> None:
        """Show the newest picture again."""
        self._told = 0

    def look(self, now: Moment) -> Sequence[Message]:
        """Return the picture, if it is a new one."""
        picture = self.newest()
        if picture is None or self._sequence == self._told:
            return ()
        self._told = self._sequence
        times = {
            "stamp_s": round(now.wall_s(picture.stamp_ns), 4),
            "age_s": round(now.age_s(picture.stamp_ns), 4),
        }
        header = {"topic": self.topic, **times, **picture.header}
        return (binary_message(self.topic, Binary.CAMERA_JPEG, header, picture.jpeg),)

    def newest(self) -> Picture | None:
        """Return the newest picture, None before the first; a picture is encoded once.

        Raises:
            BadPayload: the frame has another size than it says.
        """
        beat = self._pulse.latest()
        if beat is not None and beat.sequence != self._sequence:
            frame = self._frames.latest()
            if frame is not None:
                self._picture, self._sequence = self._encoded(frame), frame.sequence
        return self._picture

    def _encoded(self, frame: Frame) -> Picture:
        image, ratio = _shrunk(colours(frame))
        _, jpeg = cv2.imencode(".jpg", image[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
        found = self._detections.in_frame(frame)
        for one in found:
            one["box"] = [round(value * ratio, 1) for value in one["box"]]
        height, width = image.shape[:2]
        header = {"width": width, "height": height, "detections": found}
        return Picture(jpeg=jpeg.tobytes(), stamp_ns=frame.stamp_ns, header=header)


def _shrunk(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], float]:
    """Return an image no wider than `WIDEST_PX`, and by how much it shrank."""
    ratio = min(1.0, WIDEST_PX / image.shape[1])
    if ratio == 1.0:
        return image, ratio
    size = (round(image.shape[1] * ratio), round(image.shape[0] * ratio))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8), ratio
