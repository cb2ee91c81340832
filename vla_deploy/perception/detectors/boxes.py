"""Hold the boxes that a detector found, and suppress those of the same thing."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Indices = NDArray[np.intp]
# More boxes than any room holds: a detector that finds more finds noise.
MAX_CANDIDATES: Final = 3000
MAX_BOXES: Final = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class Boxes:
    """Hold boxes, the surest first.

    `corners_px` is (n, 4): left, top, right, bottom in pixels, with fractions. `scores` is (n,),
    from 0 to 1. `classes` is (n,), each a number in the model's list of classes.
    """

    corners_px: Floats
    scores: Floats
    classes: Indices

    def __len__(self) -> int:
        return len(self.scores)

    def where(self, chosen: NDArray[Any]) -> "Boxes":
        """Return some of them, by a mask or by indices."""
        return Boxes(
            corners_px=self.corners_px[chosen],
            scores=self.scores[chosen],
            classes=self.classes[chosen],
        )


def valid_boxes(boxes: Boxes, score_threshold: float) -> Boxes:
    """Return the boxes that score enough, are finite and not empty, the surest first."""
    left, top, right, bottom = boxes.corners_px.T
    finite = np.isfinite(boxes.corners_px).all(axis=1)
    good = (boxes.scores >= score_threshold) & finite & (right > left) & (bottom > top)
    kept = boxes.where(good)
    order = np.argsort(-kept.scores, kind="stable")
    return kept.where(order[:MAX_CANDIDATES])


def suppress_overlaps(boxes: Boxes, iou_threshold: float) -> Boxes:
    """Suppress non-maxima: return boxes, given the surest first, without those that one covers.

    A box is covered by a surer one of its class that overlaps it by more than the threshold.
    """
    left = np.arange(len(boxes))
    kept: list[int] = []
    while len(left) and len(kept) < MAX_BOXES:
        best, rest = int(left[0]), left[1:]
        kept.append(best)
        overlaps = iou(boxes.corners_px[best], boxes.corners_px[rest])
        covered = (overlaps > iou_threshold) & (boxes.classes[rest] == boxes.classes[best])
        left = rest[~covered]
    return boxes.where(np.array(kept, dtype=np.intp))


def iou(box: Floats, others: Floats) -> Floats:
    """Return by how much a box (4,) overlaps others (n, 4): intersection over union, 0..1."""
    low = np.maximum(box[:2], others[:, :2])
    high = np.minimum(box[2:], others[:, 2:])
    shared = np.clip(high - low, 0.0, None).prod(axis=1)
    union = (box[2:] - box[:2]).prod() + (others[:, 2:] - others[:, :2]).prod(axis=1) - shared
    ratio: Floats = shared / np.maximum(union, np.float32(1e-9))
    return ratio
