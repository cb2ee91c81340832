"""Compress camera images for the recording: colour as JPEG, depth as 16-bit PNG."""

import cv2
import numpy as np

from vla_deploy.ipc import Frame

_JPEG = (cv2.IMWRITE_JPEG_QUALITY, 80)
_PNG = (cv2.IMWRITE_PNG_COMPRESSION, 1)


def compress(frame: Frame) -> dict[str, bytes]:
    """Return the parts of one colour and depth image, by channel."""
    pixels = frame.width * frame.height
    shape = (frame.height, frame.width)
    colour = np.frombuffer(frame.payload, np.uint8, 3 * pixels).reshape(*shape, 3)
    depth = np.frombuffer(frame.payload, "<u2", pixels, 3 * pixels).reshape(shape)
    _, jpeg = cv2.imencode(".jpg", colour[..., ::-1], _JPEG)
    _, png = cv2.imencode(".png", depth, _PNG)
    return {"colour": jpeg.tobytes(), "depth": png.tobytes()}
