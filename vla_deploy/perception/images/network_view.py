"""Hold what the detector found in an image, and ask it about places there.

Networks learn from images in which straight lines are straight, so the detector gets the image of
a pinhole camera. Everything else works on the image as the lens bends it, where depth and colour of
a pixel belong together: the boxes are moved there.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.inference.manifest import DetectionOutputs
from vla_deploy.perception.detectors.boxes import Boxes, Floats, iou
from vla_deploy.perception.geometry.lens import distorted_boxes, needs_undistortion, undistorted
from vla_deploy.perception.naming.class_fusion import ClassVote, chance_of
from vla_deploy.perception.naming.class_weighting import ClassReliability, class_reliabilities

SAME_IOU: Final = 0.5
"""Above one half, no box can be the same thing as two that do not overlap."""
SAME_PLACE_IOU: Final = 0.85
"""Boxes that overlap more are one person or chair, whichever of the two they were called."""
SEEN_PX: Final = 12
"""The detector finds nothing smaller: that it found nothing there means nothing."""
Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkView:
    """Hold the detector's boxes in an image's pixels, and how reliable each of its classes is.

    A box with at least `sure_score` stands for a thing by itself; one below only helps to name what
    depth has found.
    """

    boxes: Boxes
    reliabilities: tuple[ClassReliability, ...]
    sure_score: float = 0.0

    @classmethod
    def of(cls, boxes: Boxes, detection: DetectionOutputs) -> "NetworkView":
        """Return the view of a model that declares how its outputs are read."""
        return cls(
            boxes=boxes,
            reliabilities=class_reliabilities(detection),
            sure_score=detection.score_threshold,
        )

    def joined(self, other: "NetworkView") -> "NetworkView":
        """Return a view with the boxes of another one, too."""
        boxes, more = self.boxes, other.boxes
        return replace(
            self,
            boxes=Boxes(
                corners_px=np.concatenate((boxes.corners_px, more.corners_px)),
                scores=np.concatenate((boxes.scores, more.scores)),
                classes=np.concatenate((boxes.classes, more.classes + len(self.reliabilities))),
            ),
            reliabilities=(*self.reliabilities, *other.reliabilities),
        )

    def at(self, corners_px: Floats) -> "NetworkView":
        """Return the same view with its boxes at other places."""
        return replace(self, boxes=replace(self.boxes, corners_px=corners_px))

    def votes_for(self, box_px: Box) -> list[ClassVote]:
        """Return the votes for the thing that fills a box (left, top, right, bottom).

        There is one for each class that was found in its place, the surest first.
        """
        overlaps = iou(np.array(box_px, dtype=np.float32), self.boxes.corners_px)
        votes = [self._vote(int(number)) for number in np.flatnonzero(overlaps > SAME_IOU)]
        by_class: dict[str, ClassVote] = {}
        for vote in sorted(votes, key=lambda vote: vote.chance, reverse=True):
            by_class.setdefault(vote.class_name, vote)
        return list(by_class.values())

    def sure_votes(self, classes: Collection[str]) -> Iterator[tuple[Floats, ClassVote]]:
        """Yield the places of some classes, left, top, right, bottom, and the vote for each.

        Boxes that are not sure, and further names for the same place, are left out.
        """
        yielded: list[Floats] = []
        for number in np.flatnonzero(self.boxes.scores >= self.sure_score):
            corners, vote = self.boxes.corners_px[number], self._vote(int(number))
            if vote.class_name not in classes or any(
                iou(corners, other[None])[0] > SAME_PLACE_IOU for other in yielded
            ):
                continue
            yielded.append(corners)
            yield corners, vote

    def recall_at(self, box_px: Box, class_name: str) -> float:
        """Return how surely the detector would have found a thing of a class in a box."""
        left, top, right, bottom = box_px
        if max(right - left, bottom - top) < SEEN_PX:
            return 0.0
        recalls = [one.recall for one in self.reliabilities if one.class_name == class_name]
        return max(recalls, default=0.0)

    def _vote(self, number: int) -> ClassVote:
        reliability = self.reliabilities[self.boxes.classes[number]]
        chance = chance_of(float(self.boxes.scores[number]), reliability.precision)
        return ClassVote(class_name=reliability.class_name, chance=chance)


def as_pinhole(frame: RgbdFrame) -> NDArray[np.uint8]:
    """Return the image without the lens' distortion; as it is where that is too small to matter."""
    camera = frame.intrinsics
    return undistorted(frame.rgb, camera) if needs_undistortion(camera) else frame.rgb


def to_camera_image(network: NetworkView | None, camera: Intrinsics) -> NetworkView | None:
    """Return what was found in `as_pinhole`, its boxes as they lie in the camera's own image."""
    if network is None or not needs_undistortion(camera):
        return network
    return network.at(distorted_boxes(camera, network.boxes.corners_px))
