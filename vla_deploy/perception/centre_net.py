"""Read boxes from the maps of a centre network: peaks of the heat, edges around them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

MAX_BOXES = 60
MIN_SCORE = 0.3
SAME_CLASS_IOU = 0.5
"""Of two boxes of one class that overlap more, the better one is kept."""
OTHER_CLASS_IOU = 0.85
"""Two boxes that overlap this much are one thing, whatever their classes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Boxes:
    """Hold N found boxes, the best first: edges (N x 4: left, top, right, bottom, in pixels of the
    network's input), class indices (N) and scores from 0 to 1 (N).
    """

    edges_px: Floats
    classes: NDArray[np.int32]
    scores: Floats

    def __len__(self) -> int:
        return len(self.scores)


def decode(
    heat: Floats,
    edges: Floats,
    *,
    stride_px: int,
    min_score: float = MIN_SCORE,
    max_boxes: int = MAX_BOXES,
) -> Boxes:
    """Return the boxes that the maps of one image tell.

    `heat` is classes x h x w, from 0 to 1; `edges` is 4 x h x w, distances in pixels from a cell's
    centre to the left, top, right and bottom edge; a cell covers `stride_px` x `stride_px` pixels.

    Raises:
        ValueError: the shapes do not fit together, or a value that matters is not finite.
    """
    _check(heat, edges)
    classes, rows, columns = _peaks(heat, min_score)
    scores = heat[classes, rows, columns]
    best = np.argsort(-scores, kind="stable")[: 3 * max_boxes]
    classes, rows, columns, scores = classes[best], rows[best], columns[best], scores[best]
    boxes = _boxes(edges, rows, columns, stride_px)
    kept = _without_doubles(boxes, classes)[:max_boxes]
    return Boxes(edges_px=boxes[kept], classes=classes[kept].astype(np.int32), scores=scores[kept])


def overlap(box: Floats, others: Floats) -> Floats:
    """Return the intersection over union of one box (4) with each of the others (N x 4)."""
    shared = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    inner = shared.clip(0).prod(axis=1)
    union = _area(box[None])[0] + _area(others) - inner
    return np.asarray(inner / np.maximum(union, 1e-6), np.float32)


def _check(heat: Floats, edges: Floats) -> None:
    if heat.ndim != 3 or edges.shape != (4, *heat.shape[1:]):
        raise ValueError(
            f"centre network: expected heat of classes x h x w and edges of 4 x h x w, got "
            f"{heat.shape} and {edges.shape}; is this the right output adapter for the model?"
        )
    if not np.isfinite(heat).all():
        raise ValueError("centre network: the heat has values that are not finite; check the model")


def _peaks(
    heat: Floats, min_score: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return class, row and column of cells that no neighbour surpasses; few pass the score."""
    classes, rows, columns = np.nonzero(heat >= min_score)
    values = heat[classes, rows, columns]
    _, height, width = heat.shape
    top = np.ones(len(values), bool)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            beside = heat[
                classes, (rows + down).clip(0, height - 1), (columns + right).clip(0, width - 1)
            ]
            top &= beside <= values
    return classes[top], rows[top], columns[top]


def _boxes(
    edges: Floats, rows: NDArray[np.intp], columns: NDArray[np.intp], stride_px: int
) -> Floats:
    """Return boxes, cut to the image, around the centres of the cells."""
    left, top, right, bottom = edges[:, rows, columns]
    if not np.isfinite(edges[:, rows, columns]).all():
        raise ValueError("centre network: a box is not finite; check the model")
    x, y = (columns + 0.5) * stride_px, (rows + 0.5) * stride_px
    height, width = (size * stride_px for size in edges.shape[1:])
    boxes = np.stack([x - left, y - top, x + right, y + bottom], axis=1)
    return np.asarray(boxes.clip(0, [width, height, width, height]), np.float32)


def _without_doubles(boxes: Floats, classes: NDArray[np.intp]) -> list[int]:
    """Return the numbers of the boxes that no better one covers; the boxes come best first."""
    kept: list[int] = []
    for number, box in enumerate(boxes):
        ious = overlap(box, boxes[kept])
        limits = np.where(classes[kept] == classes[number], SAME_CLASS_IOU, OTHER_CLASS_IOU)
        if not (ious > limits).any():
            kept.append(number)
    return kept


def _area(boxes: Floats) -> Floats:
    return np.asarray((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1]), np.float32)
