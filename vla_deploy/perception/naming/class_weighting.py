"""Weigh what a network says of each of its classes by what was measured of that class.

Few boxes say little: ten that nobody measured are added to what was counted, so that a class with
three right boxes of three counts for less than one with three hundred. A class that the labelled
images did not show counts as one that nobody measured, however good the others are.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from vla_deploy.inference.manifest import ClassMeasured, DetectionOutputs, Measured
from vla_deploy.perception.naming.class_names import known_as

UNKNOWN_PRECISION: Final = 0.5
UNKNOWN_RECALL: Final = 0.0
"""What a class is taken for that nobody measured: it may support a name and overrule none."""
UNMEASURED_COUNT: Final = 10
NETWORKS_KEPT: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Voice:
    """Hold the robot's word for one class of a network, and how far to believe it there."""

    class_name: str
    precision: float = UNKNOWN_PRECISION
    recall: float = UNKNOWN_RECALL


@lru_cache(maxsize=NETWORKS_KEPT)
def voices_of(detection: DetectionOutputs) -> tuple[Voice, ...]:
    """Return a voice for each of a network's classes, in the order of their numbers."""
    return tuple(_voice(name, detection.measured) for name in detection.classes)


def _voice(name: str, measured: Measured | None) -> Voice:
    told = known_as(name)
    if measured is None:
        return Voice(class_name=told)
    if not measured.classes:
        return _weighed(told, measured, measured.boxes, measured.things)
    own = next((one for one in measured.classes if one.name == name), None)
    return Voice(class_name=told) if own is None else _weighed(told, own, own.boxes, own.things)


def _weighed(
    told: str, figures: Measured | ClassMeasured, boxes: int | None, things: int | None
) -> Voice:
    return Voice(
        class_name=told,
        precision=_drawn(figures.precision, boxes, UNKNOWN_PRECISION),
        recall=_drawn(figures.recall, things, UNKNOWN_RECALL),
    )


def _drawn(ratio: float, count: int | None, unknown: float) -> float:
    """Draw a ratio towards what is taken for it where nothing is known; None: as it was stated."""
    if count is None:
        return ratio
    return (ratio * count + unknown * UNMEASURED_COUNT) / (count + UNMEASURED_COUNT)
