"""Hold what a network saw in one image, for whoever asks about a place in it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.inference.manifest import Detection, Measured
from vla_deploy.perception.detectors.boxes import Boxes, iou
from vla_deploy.perception.naming import Word, chance_of

SAME_IOU: Final = 0.5
"""Above one half, no box can be the same thing as two that do not overlap."""
SEEN_PX: Final = 12
"""A network says nothing of smaller things; its silence there means nothing."""
UNMEASURED: Final = Measured(precision=0.5, recall=0.0)
"""What a model is taken for that nobody measured: it may support a name and overrule none."""
Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkView:
    """Hold a network's boxes in an image's pixels, its classes, and how good it is."""

    boxes: Boxes
    classes: tuple[str, ...]
    measured: Measured

    @classmethod
    def of(cls, boxes: Boxes, detection: Detection) -> "NetworkView":
        """Return the view of a model that declares how its outputs are read."""
        measured = detection.measured or UNMEASURED
        return cls(boxes=boxes, classes=detection.classes, measured=measured)

    def word_for(self, box_px: Box) -> Word | None:
        """Return the surest word for the thing that fills a box (left, top, right, bottom)."""
        overlaps = iou(np.array(box_px, dtype=np.float32), self.boxes.corners_px)
        same = np.flatnonzero(overlaps > SAME_IOU)
        return self.word(int(same[0])) if same.size else None

    def word(self, number: int) -> Word:
        """Return what one of the boxes says."""
        chance = chance_of(float(self.boxes.scores[number]), self.measured.precision)
        return Word(class_name=self.classes[self.boxes.classes[number]], chance=chance)

    def silence(self, box_px: Box) -> float:
        """Return how surely a thing of one of its classes would have been found in a box."""
        left, top, right, bottom = box_px
        return self.measured.recall if max(right - left, bottom - top) >= SEEN_PX else 0.0
