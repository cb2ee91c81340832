"""Read the pixels of a frame of the topic `rgbd`: colours, then depth in millimetres."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.frame_ring import Frame

MILLIMETRE_M: Final = 0.001
_RGB_BYTES: Final = 3
_BYTES_PER_PIXEL: Final = 5


def colours(frame: Frame) -> NDArray[np.uint8]:
    """Return (height, width, 3) red, green and blue, a view of the frame.

    Raises:
        BadPayload: the frame has another size than it says.
    """
    pixels = _checked_pixels(frame)
    flat = np.frombuffer(frame.payload, np.uint8, _RGB_BYTES * pixels)
    return flat.reshape(frame.height, frame.width, 3)


def depths_mm(frame: Frame) -> NDArray[np.uint16]:
    """Return (height, width) depths along the optical axis, 0 for none, a view of the frame.

    Raises:
        BadPayload: the frame has another size than it says.
    """
    pixels = _checked_pixels(frame)
    flat = np.frombuffer(frame.payload, "<u2", pixels, _RGB_BYTES * pixels)
    return flat.reshape(frame.height, frame.width)


def depths_m(frame: Frame) -> NDArray[np.float32]:
    """Return `depths_mm` in metres.

    Raises:
        BadPayload: the frame has another size than it says.
    """
    return depths_mm(frame).astype(np.float32) * np.float32(MILLIMETRE_M)


def _checked_pixels(frame: Frame) -> int:
    pixels = frame.width * frame.height
    if len(frame.payload) != _BYTES_PER_PIXEL * pixels:
        raise BadPayload(
            f"an image of {frame.width} x {frame.height} has {len(frame.payload)} bytes, expected "
            f"{_BYTES_PER_PIXEL * pixels}; do both sides come from the same release?"
        )
    return pixels
