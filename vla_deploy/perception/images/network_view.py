"""Hold what a network saw in one image, for whoever asks about a place in it."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from vla_deploy.inference.manifest import DetectionOutputs
from vla_deploy.perception.detectors.boxes import Boxes, Floats, iou
from vla_deploy.perception.naming.class_weighting import Voice, voices_of
from vla_deploy.perception.naming.object_name import ClassVote, chance_of

SAME_IOU: Final = 0.5
"""Above one half, no box can be the same thing as two that do not overlap."""
SAME_PLACE_IOU: Final = 0.85
"""Boxes that overlap more are one person or chair, whichever of the two they were called."""
SEEN_PX: Final = 12
"""A network says nothing of smaller things; its silence there means nothing."""
Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkView:
    """Hold a network's boxes in an image's pixels, and a voice for each of its classes."""

    boxes: Boxes
    voices: tuple[Voice, ...]
    sure_score: float = 0.0
    """From which a box tells of a thing by itself; one below only helps to name what is there."""

    @classmethod
    def of(cls, boxes: Boxes, detection: DetectionOutputs) -> "NetworkView":
        """Return the view of a model that declares how its outputs are read."""
        voices, sure_score = voices_of(detection), detection.score_threshold
        return cls(boxes=boxes, voices=voices, sure_score=sure_score)

    def words_for(self, box_px: Box) -> list[ClassVote]:
        """Return the words for the thing that fills a box (left, top, right, bottom).

        There is one for each class that was seen in its place, the surest first.
        """
        overlaps = iou(np.array(box_px, dtype=np.float32), self.boxes.corners_px)
        words = [self.word(int(number)) for number in np.flatnonzero(overlaps > SAME_IOU)]
        by_class: dict[str, ClassVote] = {}
        for word in sorted(words, key=lambda word: word.chance, reverse=True):
            by_class.setdefault(word.class_name, word)
        return list(by_class.values())

    def sure_words(self, classes: Collection[str]) -> Iterator[tuple[Floats, ClassVote]]:
        """Yield the places of some classes, left, top, right, bottom, and what each was called.

        Boxes that are not sure, and further names for the same place, are left out.
        """
        told: list[Floats] = []
        for number in np.flatnonzero(self.boxes.scores >= self.sure_score):
            corners, word = self.boxes.corners_px[number], self.word(int(number))
            if word.class_name not in classes or any(
                iou(corners, other[None])[0] > SAME_PLACE_IOU for other in told
            ):
                continue
            told.append(corners)
            yield corners, word

    def word(self, number: int) -> ClassVote:
        """Return what one of the boxes says."""
        voice = self.voices[self.boxes.classes[number]]
        chance = chance_of(float(self.boxes.scores[number]), voice.precision)
        return ClassVote(class_name=voice.class_name, chance=chance)

    def silence(self, box_px: Box, class_name: str) -> float:
        """Return how surely a thing of a class would have been found in a box."""
        left, top, right, bottom = box_px
        if max(right - left, bottom - top) < SEEN_PX:
            return 0.0
        recalls = [one.recall for one in self.voices if one.class_name == class_name]
        return max(recalls, default=0.0)
