"""Turn a segmentation into labelled boxes, and say which are too little seen to be judged."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.detector.classes import CLASSES, CLUTTER, LARGE
from training.detector.drawing import HEIGHT_PX, WIDTH_PX
from training.detector.layout import Layout
from training.detector.pose import CAMERA
from training.detector.scene_model import Stage

MIN_PIXELS = 36
MIN_LONG_PX, MIN_SHORT_PX = 10.0, 4.0
MIN_SEEN_RATIO = 0.3
MIN_IN_IMAGE_RATIO = 0.35
MIN_IN_IMAGE_LARGE_RATIO = 0.06
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """Hold the box of what is seen of one thing, edges in pixels; `judged` or to be passed over."""

    class_index: int
    box_px: tuple[float, float, float, float]
    judged: bool


def label(stage: Stage, layout: Layout, geoms: NDArray[np.int32]) -> list[Label]:
    """Return a label for each thing of which the image shows anything."""
    wanted = [(p.thing.class_name, p.geoms) for p in layout.shown if p.thing.class_name != CLUTTER]
    owner = np.full(stage.model.ngeom + 1, -1, np.int32)
    groups = [*wanted, *stage.fixed]
    for number, (_, members) in enumerate(groups):
        owner[members] = number
    seen = owner[geoms]
    labels = (_label(stage, *group, seen == number) for number, group in enumerate(groups))
    return [found for found in labels if found is not None]


def _label(
    stage: Stage, class_name: str, members: list[int], mask: NDArray[np.bool_]
) -> Label | None:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None
    box = (float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))
    known = class_name in CLASSES
    judged = known and _is_clear(stage, class_name, members, box, int(mask.sum()))
    index = CLASSES.index(class_name) if known else -1
    return Label(class_index=index, box_px=box, judged=judged)


def _is_clear(
    stage: Stage, class_name: str, members: list[int], box: tuple[float, ...], pixels: int
) -> bool:
    """Tell whether enough of the thing is seen, in pixels and as a share of its whole extent."""
    wide, high = box[2] - box[0], box[3] - box[1]
    if pixels < MIN_PIXELS or max(wide, high) < MIN_LONG_PX or min(wide, high) < MIN_SHORT_PX:
        return False
    whole = _extent(stage.model, stage.data, members)
    if whole is None:
        return class_name in LARGE
    inside = whole.clip(0, [WIDTH_PX, HEIGHT_PX, WIDTH_PX, HEIGHT_PX])
    least = MIN_IN_IMAGE_LARGE_RATIO if class_name in LARGE else MIN_IN_IMAGE_RATIO
    return wide * high >= MIN_SEEN_RATIO * _area(inside) and _area(inside) >= least * _area(whole)


def _area(box: NDArray[np.float64]) -> float:
    return float((box[2] - box[0]) * (box[3] - box[1]))


def _extent(model: Any, data: Any, members: list[int]) -> NDArray[np.float64] | None:
    """Return the box that the whole thing would fill; none where it reaches behind the camera."""
    centre, half = model.geom_aabb[members, :3], model.geom_aabb[members, 3:]
    local = centre[:, None] + half[:, None] * _CORNERS
    turn = data.geom_xmat[members].reshape(-1, 3, 3)
    points = (np.einsum("gij,gcj->gci", turn, local) + data.geom_xpos[members][:, None]).reshape(
        -1, 3
    )
    camera = model.camera(CAMERA).id
    in_view = (points - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
    depth = -in_view[:, 2]
    if depth.min() < 0.02:
        return None
    focal = 0.5 * HEIGHT_PX / np.tan(np.radians(model.cam_fovy[camera]) / 2)
    u = WIDTH_PX / 2 + focal * in_view[:, 0] / depth
    v = HEIGHT_PX / 2 - focal * in_view[:, 1] / depth
    return np.array([u.min(), v.min(), u.max(), v.max()])
