"""Translate a detector's classes into the robot's own, and weigh them by measured reliability.

Few boxes say little: ten unmeasured ones are added to those counted, so that a class with three
right boxes of three counts for less than one with three hundred. A class that the labelled images
did not show counts as unmeasured, however good the others are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Final

from vla_deploy.inference.manifest import ClassMeasured, DetectionOutputs, Measured
from vla_deploy.perception.naming.classes import FURNITURE

UNKNOWN_PRECISION: Final = 0.5
UNKNOWN_RECALL: Final = 0.0
"""Of a class that was not measured: it may support a name and overrule none."""
UNMEASURED_COUNT: Final = 10
NETWORKS_KEPT: Final = 4
# Only words for the same kind: a wine glass is no cup here, since a name that nearly fits would
# support a wrong one. A class that is in no list keeps its own name.
_WORDS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "cup": ("mug", "coffee cup", "coffee mug", "teacup", "drinking cup"),
        "ball": ("sports ball", "tennis ball", "toy ball"),
        "book": ("books", "notebook"),
        "bottle": ("water bottle", "wine bottle", "plastic bottle", "beer bottle"),
        "phone": ("cell phone", "cellphone", "mobile phone", "smartphone", "smart phone"),
        "keys": ("key", "key ring", "bunch of keys"),
        "box": ("cardboard box", "carton", "storage box"),
        "can": ("tin can", "beverage can", "soda can", "drink can"),
        "remote": ("remote control", "tv remote"),
        "person": ("man", "woman", "boy", "girl", "child", "human", "pedestrian"),
        "chair": ("armchair", "stool", "office chair"),
        FURNITURE: (
            "dining table", "coffee table", "kitchen table", "table", "desk", "couch", "sofa",
            "sofa bed", "bed", "bench", "cabinet", "cupboard", "wardrobe", "closet", "shelf",
            "bookcase", "nightstand", "chest of drawers", "refrigerator", "fridge", "oven",
            "dishwasher", "washing machine", "sink", "toilet", "bathtub",
        ),
    }
)  # fmt: skip
CLASS_SYNONYMS: Final[Mapping[str, str]] = MappingProxyType(
    {word: name for name, words in _WORDS.items() for word in (name, *words)}
)
"""COCO's, Open Images' and Objects365's names of what the robot knows, in small letters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassReliability:
    """Hold the robot's word for one class of a detector, and how reliable that is."""

    class_name: str
    precision: float = UNKNOWN_PRECISION
    recall: float = UNKNOWN_RECALL


def robot_class(class_name: str) -> str:
    """Return the robot's word for a detector's class: the class itself where it has no other."""
    words = class_name.lower().replace("_", " ").replace("-", " ")
    return CLASS_SYNONYMS.get(" ".join(words.split()), class_name)


@lru_cache(maxsize=NETWORKS_KEPT)
def class_reliabilities(detection: DetectionOutputs) -> tuple[ClassReliability, ...]:
    """Return the reliability of each of a detector's classes, in the order of their numbers."""
    return tuple(_reliability(name, detection.measured) for name in detection.classes)


def _reliability(name: str, measured: Measured | None) -> ClassReliability:
    figures: Measured | ClassMeasured | None = measured
    if measured is not None and measured.classes:
        figures = next((one for one in measured.classes if one.name == name), None)
    if figures is None:
        return ClassReliability(class_name=robot_class(name))
    return ClassReliability(
        class_name=robot_class(name),
        precision=_shrunk(figures.precision, figures.boxes, UNKNOWN_PRECISION),
        recall=_shrunk(figures.recall, figures.things, UNKNOWN_RECALL),
    )


def _shrunk(ratio: float, count: int | None, unknown: float) -> float:
    """Shrink a ratio of few boxes towards `unknown`; without a count, keep it as stated."""
    if count is None:
        return ratio
    return (ratio * count + unknown * UNMEASURED_COUNT) / (count + UNMEASURED_COUNT)
