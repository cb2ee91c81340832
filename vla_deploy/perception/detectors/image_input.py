"""Turn an image into a detector's input, and its boxes back into the image."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.manifest import Fit, ImageInput, TensorLayout
from vla_deploy.perception.detectors.boxes import Boxes, Floats

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class InputPlacement:
    """Hold where the image lies in the input: pixel p of it is at p * scale + offset."""

    scale_x: float
    scale_y: float
    left_px: int
    top_px: int
    width_px: int
    height_px: int

    def to_image(self, boxes: Boxes) -> Boxes:
        """Return boxes of the input as boxes of the image, cut off at its borders.

        Boxes that lie wholly in the padding are left out.
        """
        offset = np.array([self.left_px, self.top_px] * 2, dtype=np.float32)
        scale = np.array([self.scale_x, self.scale_y] * 2, dtype=np.float32)
        border = np.array([self.width_px, self.height_px] * 2, dtype=np.float32)
        corners: Floats = ((boxes.corners_px - offset) / scale).clip(0.0, border)
        inside = (corners[:, 2] > corners[:, 0]) & (corners[:, 3] > corners[:, 1])
        return replace(boxes, corners_px=corners).where(inside)


def fit_image(rgb: Image, image: ImageInput, dtype: str) -> tuple[NDArray[Any], InputPlacement]:
    """Return an RGB image (h, w, 3) as a detector's input (1, ...), and where it lies in it."""
    fitted, placement = _FITS[image.fit](rgb, image)
    if image.colour == "bgr":
        fitted = fitted[..., ::-1]
    pixels = _normalised(fitted, image).astype(dtype, copy=False)
    ordered = pixels.transpose(2, 0, 1) if image.layout == TensorLayout.NCHW else pixels
    return np.ascontiguousarray(ordered)[None], placement


def _normalised(fitted: Image, image: ImageInput) -> Floats:
    pixels = fitted.astype(np.float32)
    pixels *= np.float32(image.scale)
    if any(image.mean):
        pixels -= np.array(image.mean, dtype=np.float32)
    if image.std != (1.0, 1.0, 1.0):
        pixels /= np.array(image.std, dtype=np.float32)
    return pixels


def _letterbox(rgb: Image, image: ImageInput) -> tuple[Image, InputPlacement]:
    height, width = rgb.shape[:2]
    ratio = min(image.width_px / width, image.height_px / height)
    inner = max(1, round(width * ratio)), max(1, round(height * ratio))
    left, top = (image.width_px - inner[0]) // 2, (image.height_px - inner[1]) // 2
    canvas = np.full((image.height_px, image.width_px, 3), image.fill, dtype=np.uint8)
    canvas[top : top + inner[1], left : left + inner[0]] = _resized(rgb, inner)
    return canvas, _placement(rgb, inner, (left, top))


def _stretch(rgb: Image, image: ImageInput) -> tuple[Image, InputPlacement]:
    size = image.width_px, image.height_px
    return _resized(rgb, size), _placement(rgb, size, (0, 0))


def _placement(rgb: Image, inner: tuple[int, int], offset: tuple[int, int]) -> InputPlacement:
    height, width = rgb.shape[:2]
    return InputPlacement(
        scale_x=inner[0] / width,
        scale_y=inner[1] / height,
        left_px=offset[0],
        top_px=offset[1],
        width_px=width,
        height_px=height,
    )


def _resized(rgb: Image, size: tuple[int, int]) -> Image:
    if rgb.shape[:2] == size[::-1]:
        return rgb
    resized: Image = cv2.resize(rgb, size, interpolation=cv2.INTER_LINEAR)
    return resized


_FITS: Final[Mapping[Fit, Callable[[Image, ImageInput], tuple[Image, InputPlacement]]]] = {
    Fit.LETTERBOX: _letterbox,
    Fit.STRETCH: _stretch,
}
