"""Judge found boxes against labels: average precision, and how many centres are hit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.detector.classes import CLASSES
from vla_deploy.model_tools.detectors.accuracy import average_precision
from vla_deploy.perception.detectors.boxes import Boxes, iou

MATCH_IOU, TIGHT_IOU = 0.5, 0.75
SURE_SCORE = 0.35
"""Score from which a box tells of a thing by itself."""
WEAK_SCORE = 0.15
"""Score from which a box helps to name a thing that the depth image shows: on a thing, one box in
three from here to 0.2 has the right name, as the robot takes it for.
"""
Rows = NDArray[np.float32]
Matches = tuple[NDArray[np.float32], NDArray[np.bool_]]
"""Scores of boxes, and which of them fit a label."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassFigures:
    """Hold the figures of one class, from 0 to 1, and how many labels were judged.

    `recall` is the share of labels whose centre lies in a box of the class that overlaps it, a weak
    one at least; `sure_recall` that with a sure box, `precision` the share of sure boxes that fit a
    label.
    """

    ap50: float
    ap75: float
    recall: float
    sure_recall: float
    precision: float
    labels: int


def judge(found: Sequence[Boxes], labels: Sequence[Rows]) -> dict[str, ClassFigures]:
    """Return a judgement for each class over all images, in the images' order."""
    return {name: _judge_class(index, found, labels) for index, name in enumerate(CLASSES)}


def _judge_class(index: int, found: Sequence[Boxes], labels: Sequence[Rows]) -> ClassFigures:
    at50 = [
        _match(index, boxes, rows, MATCH_IOU) for boxes, rows in zip(found, labels, strict=True)
    ]
    at75 = [
        _match(index, boxes, rows, TIGHT_IOU) for boxes, rows in zip(found, labels, strict=True)
    ]
    count = sum(int(_judged(index, rows).sum()) for rows in labels)
    recall, sure_recall = (
        _centres_hit(index, found, labels, score) / max(count, 1)
        for score in (WEAK_SCORE, SURE_SCORE)
    )
    scores, right = _joined(at50)
    sure = scores >= SURE_SCORE
    return ClassFigures(
        ap50=average_precision(scores, right, count) if count else 0.0,
        ap75=average_precision(*_joined(at75), count) if count else 0.0,
        recall=recall,
        sure_recall=sure_recall,
        precision=float(right[sure].mean()) if sure.any() else 0.0,
        labels=count,
    )


def _joined(matches: Sequence[Matches]) -> Matches:
    scores, right = zip(*matches, strict=True)
    return np.concatenate(scores), np.concatenate(right)


def _judged(index: int, rows: Rows) -> NDArray[np.bool_]:
    return np.asarray((rows[:, 1] == index) & (rows[:, 6] > 0))


def _passed_over(index: int, rows: Rows) -> NDArray[np.bool_]:
    """Mark labels that may be found or not: too little is seen, or they are not to be judged."""
    return np.asarray((rows[:, 6] == 0) & ((rows[:, 1] == index) | (rows[:, 1] < 0)))


def _match(index: int, boxes: Boxes, rows: Rows, least_iou: float) -> Matches:
    """Return the scores of the boxes of a class, and which of them fit a label of their own."""
    wanted, spare = rows[_judged(index, rows), 2:6], rows[_passed_over(index, rows), 2:6]
    free = np.ones(len(wanted), bool)
    scores, right = [], []
    for number in np.flatnonzero(boxes.classes == index):
        box = boxes.corners_px[number]
        ious = iou(box, wanted) * free
        best = int(np.argmax(ious)) if len(ious) else -1
        fits = best >= 0 and bool(ious[best] >= least_iou)
        if fits:
            free[best] = False
        elif _mostly_inside(box, spare):
            continue
        scores.append(boxes.scores[number])
        right.append(fits)
    return np.array(scores, np.float32), np.array(right, bool)


def _mostly_inside(box: Rows, spare: Rows) -> bool:
    shared = np.minimum(box[2:], spare[:, 2:]) - np.maximum(box[:2], spare[:, :2])
    area = float((box[2] - box[0]) * (box[3] - box[1]))
    return bool((shared.clip(0).prod(axis=1) >= 0.5 * area).any())


def _centres_hit(index: int, found: Sequence[Boxes], labels: Sequence[Rows], score: float) -> int:
    """Count a class's labels over all images that boxes from a score on hit."""
    pairs = zip(found, labels, strict=True)
    return sum(_hit_in_one(index, boxes, rows, score) for boxes, rows in pairs)


def _hit_in_one(index: int, boxes: Boxes, rows: Rows, score: float) -> int:
    """Count labels whose centre lies in a box of their class that overlaps them notably."""
    mine = (boxes.classes == index) & (boxes.scores >= score)
    hits = 0
    for label in rows[_judged(index, rows), 2:6]:
        x, y = (label[0] + label[2]) / 2, (label[1] + label[3]) / 2
        near = boxes.corners_px[mine]
        around = (near[:, 0] <= x) & (x <= near[:, 2]) & (near[:, 1] <= y) & (y <= near[:, 3])
        hits += bool((around & (iou(label, near) >= 0.3)).any())
    return hits
