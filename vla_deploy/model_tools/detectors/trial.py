"""Try a detector out on images that say nothing: it must answer, and find nothing for sure."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.inference.errors import RunFailed
from vla_deploy.perception.detectors.detector import Detector
from vla_deploy.perception.detectors.image_input import Image

_SHAPE: Final = (240, 320, 3)
_UPRIGHT: Final = (360, 200, 3)
_SEED: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorTrial:
    """Hold what a detector answered: boxes found in each of the empty images."""

    boxes: Mapping[str, int]

    def __str__(self) -> str:
        told = ", ".join(f"{name} {count}" for name, count in self.boxes.items())
        doubt = "; it sees things where nothing is: is the input as it was trained?"
        return f"boxes in empty images: {told}{doubt if any(self.boxes.values()) else ''}"


def empty_images() -> dict[str, Image]:
    """Return images with nothing in them."""
    noise = np.random.default_rng(_SEED).integers(0, 256, _SHAPE, dtype=np.uint8)
    return {
        "black": np.zeros(_SHAPE, dtype=np.uint8),
        "white": np.full(_SHAPE, 255, dtype=np.uint8),
        "grey": np.full(_UPRIGHT, 128, dtype=np.uint8),
        "noise": noise,
    }


def try_out(detector: Detector) -> DetectorTrial:
    """Run a detector on the empty images.

    Raises:
        RunFailed: it fails, or tells what cannot be; the image is named.
    """
    boxes = {}
    for name, image in empty_images().items():
        try:
            found = detector.detect(image)
            boxes[name] = int((found.scores >= detector.detection.score_threshold).sum())
        except RunFailed as error:
            raise RunFailed(f"{error} (on an image that is {name})") from error
    return DetectorTrial(boxes=boxes)
