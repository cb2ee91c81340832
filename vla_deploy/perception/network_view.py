"""Hold what a network saw in one image, for whoever asks about a place in it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.inference.manifest import Detection
from vla_deploy.perception.detectors.boxes import Boxes, iou
from vla_deploy.perception.naming import Word, chance_of
from vla_deploy.perception.voices import Voice, voices_of

SAME_IOU: Final = 0.5
"""Above one half, no box can be the same thing as two that do not overlap."""
SEEN_PX: Final = 12
"""A network says nothing of smaller things; its silence there means nothing."""
Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkView:
    """Hold a network's boxes in an image's pixels, and a voice for each of its classes."""

    boxes: Boxes
    voices: tuple[Voice, ...]

    @classmethod
    def of(cls, boxes: Boxes, detection: Detection) -> "NetworkView":
        """Return the view of a model that declares how its outputs are read."""
        return cls(boxes=boxes, voices=voices_of(detection))

    def word_for(self, box_px: Box) -> Word | None:
        """Return the surest word for the thing that fills a box (left, top, right, bottom)."""
        overlaps = iou(np.array(box_px, dtype=np.float32), self.boxes.corners_px)
        same = np.flatnonzero(overlaps > SAME_IOU)
        return self.word(int(same[0])) if same.size else None

    def word(self, number: int) -> Word:
        """Return what one of the boxes says."""
        voice = self.voices[self.boxes.classes[number]]
        chance = chance_of(float(self.boxes.scores[number]), voice.precision)
        return Word(class_name=voice.class_name, chance=chance)

    def silence(self, box_px: Box, class_name: str) -> float:
        """Return how surely a thing of a class would have been found in a box."""
        left, top, right, bottom = box_px
        if max(right - left, bottom - top) < SEEN_PX:
            return 0.0
        recalls = [one.recall for one in self.voices if one.class_name == class_name]
        return max(recalls, default=0.0)
