"""Read the images of a folder, in the order of their names."""

from pathlib import Path
from typing import Final

import cv2

from vla_deploy.inference.errors import ImagesInvalid
from vla_deploy.perception.detectors.image_input import Image

SUFFIXES: Final = (".bmp", ".jpeg", ".jpg", ".png", ".ppm", ".tif", ".tiff", ".webp")


def image_paths(folder: Path) -> list[Path]:
    """Return the images of a folder and of those below it.

    Raises:
        ImagesInvalid: it is no folder, or holds none.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        what = "holds no image" if folder.is_dir() else "no such folder"
        raise ImagesInvalid(f"{folder}: {what}; expected files ending in {', '.join(SUFFIXES)}")
    return paths


def read_image(path: Path) -> Image:
    """Return an image as RGB (h, w, 3).

    Raises:
        ImagesInvalid: it cannot be read.
    """
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if bgr is None:
        raise ImagesInvalid(f"{path}: no image that can be read; remove it or save it anew")
    rgb: Image = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)
    return rgb


def spread_paths(folder: Path, most: int) -> list[Path]:
    """Return at most so many images, spread over the folder.

    Raises:
        ImagesInvalid: there is none.
    """
    paths = image_paths(folder)
    step = max(1.0, len(paths) / most)
    return [paths[int(number * step)] for number in range(min(most, len(paths)))]
