"""Spoil a clean render as a real camera would: exposure, colour, blur, noise."""

import cv2
import numpy as np
from numpy.typing import NDArray

from training.detector.scenes.parts import Random, between

Image = NDArray[np.uint8]
CLEAN_CHANCE = 0.35
NOISE_SIGMA = 6.0
LEAST_MEAN, MOST_GAIN = 70.0, 4.0


def spoil(image: Image, random: Random) -> Image:
    """Return the image as a cheap camera might have taken it; a third stay as they are."""
    image = _exposed(image)
    if random.random() < CLEAN_CHANCE:
        return image
    gain = between(random, 0.75, 1.4) * random.uniform(0.88, 1.12, 3)
    values = image.astype(np.float32) * gain.astype(np.float32)
    gamma = np.float32(between(random, 0.75, 1.3))
    values = np.asarray(255 * (values.clip(0, 255) / 255) ** gamma, np.float32)
    if random.random() < 0.4:
        values = _blurred(values, random)
    sigma = between(random, 0, NOISE_SIGMA)
    values += np.float32(sigma) * random.standard_normal(values.shape, dtype=np.float32)
    return np.asarray(values.clip(0, 255), np.uint8)


def _exposed(image: Image) -> Image:
    """Return a dark image as bright as a camera that sets its exposure itself would make it."""
    gain = min(MOST_GAIN, LEAST_MEAN / max(float(image.mean()), 1.0))
    if gain <= 1.0:
        return image
    return np.asarray((image * np.float32(gain)).clip(0, 255), np.uint8)


def _blurred(values: NDArray[np.float32], random: Random) -> NDArray[np.float32]:
    if random.random() < 0.5:
        return np.asarray(cv2.GaussianBlur(values, (0, 0), between(random, 0.4, 1.2)), np.float32)
    length = int(random.integers(3, 9))
    kernel = np.zeros((length, length), np.float32)
    cv2.line(
        kernel, (0, int(random.integers(length))), (length - 1, int(random.integers(length))), 1.0
    )
    return np.asarray(cv2.filter2D(values, -1, kernel / kernel.sum()), np.float32)
