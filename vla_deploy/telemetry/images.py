"""Compress camera images for the recording: colour as JPEG, depth as 16-bit PNG."""

import cv2

from vla_deploy.ipc import Frame
from vla_deploy.ipc.rgbd_image import colours, depths_mm

_JPEG = (cv2.IMWRITE_JPEG_QUALITY, 80)
_PNG = (cv2.IMWRITE_PNG_COMPRESSION, 1)


def compress(frame: Frame) -> dict[str, bytes]:
    """Return the parts of one colour and depth image, by channel."""
    _, jpeg = cv2.imencode(".jpg", colours(frame)[..., ::-1], _JPEG)
    _, png = cv2.imencode(".png", depths_mm(frame), _PNG)
    return {"colour": jpeg.tobytes(), "depth": png.tobytes()}
