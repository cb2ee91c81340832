"""Turn a segmentation into labelled boxes, and say which are too little seen to be judged."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.detector.classes import CLASSES, CLUTTER, LARGE
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.scenes.layout import ImageContents
from training.detector.scenes.scene_model import SceneStage
from training.detector.scenes.silhouettes import extent


@dataclass(frozen=True, slots=True, kw_only=True)
class Least:
    """Bound what must be seen: pixels, the box's sides, and the share that is inside the image."""

    pixels: int
    long_px: float
    short_px: float
    in_image: float


SMALL_LEAST = Least(pixels=256, long_px=25.6, short_px=9.6, in_image=0.5)
LARGE_LEAST = Least(pixels=768, long_px=51.2, short_px=16.0, in_image=0.25)
NEAR_LONG_PX = 128.0
"""People and chairs with so large a box count whatever part of them is beyond the image: they are
near, just when they matter.
"""
MIN_SEEN_RATIO = 0.45
"""Of the pixels that a thing would fill if nothing hid it: a chair of which a leg and a corner are
seen fills its box and is still hidden.
"""
PixelsAlone = Callable[[list[int]], int]
"""Count the pixels of some geoms that nothing hides."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """Hold the box of what is seen of one thing, edges in pixels; `judged` or to be passed over."""

    class_index: int
    box_px: tuple[float, float, float, float]
    judged: bool


def label(
    stage: SceneStage, layout: ImageContents, geoms: NDArray[np.int32], pixels_alone: PixelsAlone
) -> list[Label]:
    """Return a label for each thing of which the image shows anything."""
    wanted = [(p.thing.class_name, p.geoms) for p in layout.shown if p.thing.class_name != CLUTTER]
    owner = np.full(stage.model.ngeom + 1, -1, np.int32)
    groups = [*wanted, *stage.fixed]
    for number, (_, members) in enumerate(groups):
        owner[members] = number
    seen = owner[geoms]
    labels = (
        _label(stage, *group, seen == number, pixels_alone) for number, group in enumerate(groups)
    )
    return [found for found in labels if found is not None]


def _label(
    stage: SceneStage,
    class_name: str,
    members: list[int],
    mask: NDArray[np.bool_],
    pixels_alone: PixelsAlone,
) -> Label | None:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None
    box = (float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))
    pixels = int(mask.sum())
    judged = (
        class_name in CLASSES
        and _is_clear(stage, class_name, members, box, pixels)
        and pixels >= MIN_SEEN_RATIO * pixels_alone(members)
    )
    # What is too little seen to be judged may be given any name; of a person or chair, its own:
    # they are large, and other things stand before them.
    named = judged or class_name in LARGE
    index = CLASSES.index(class_name) if named else -1
    return Label(class_index=index, box_px=box, judged=judged)


def _is_clear(
    stage: SceneStage, class_name: str, members: list[int], box: tuple[float, ...], pixels: int
) -> bool:
    """Return whether the thing is large enough in the image, and enough of it inside."""
    wide, high = box[2] - box[0], box[3] - box[1]
    least = LARGE_LEAST if class_name in LARGE else SMALL_LEAST
    if pixels < least.pixels or max(wide, high) < least.long_px or min(wide, high) < least.short_px:
        return False
    whole = extent(stage.model, stage.data, members)
    if whole is None:
        return class_name in LARGE
    inside = whole.clip(0, [WIDTH_PX, HEIGHT_PX, WIDTH_PX, HEIGHT_PX])
    near = class_name in LARGE and max(wide, high) >= NEAR_LONG_PX
    return near or _area(inside) >= least.in_image * _area(whole)


def _area(box: NDArray[np.float64]) -> float:
    return float((box[2] - box[0]) * (box[3] - box[1]))
