"""Make an image small enough to travel: a JPEG of bounded size."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

LONGEST_PX: Final = 640
MOST_BYTES: Final = 150_000
_QUALITIES: Final = (85, 70, 50)
_SHRINK: Final = 0.7


def small_jpeg(image: Image, most_bytes: int = MOST_BYTES) -> bytes:
    """Return an RGB image as JPEG, coarser and smaller until it fits."""
    scale = min(1.0, LONGEST_PX / max(image.shape[:2]))
    while True:
        for quality in _QUALITIES:
            jpeg = _encoded(image, scale, quality)
            if len(jpeg) <= most_bytes or max(image.shape[:2]) * scale < 2.0:
                return jpeg
        scale *= _SHRINK


def _encoded(image: Image, scale: float, quality: int) -> bytes:
    height, width = (max(1, round(scale * side)) for side in image.shape[:2])
    small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small[..., ::-1], (cv2.IMWRITE_JPEG_QUALITY, quality))
    return bytes(jpeg)
