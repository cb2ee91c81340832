"""Declare how far back the history goes, and how finely."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """Hold `span_s` in steps of `step_s`; only what `outlives` a boot is worth a disk's writes."""

    name: str
    span_s: int
    step_s: int
    outlives: bool

    @property
    def rows(self) -> int:
        """Return how many steps are held."""
        return self.span_s // self.step_s

    def index(self, wall_s: float) -> int:
        """Return the number of the step that a moment lies in."""
        return int(wall_s // self.step_s)


LEVELS: Final[tuple[Level, ...]] = (
    Level(name="1min", span_s=60, step_s=1, outlives=False),
    Level(name="10min", span_s=600, step_s=5, outlives=False),
    Level(name="1h", span_s=3600, step_s=30, outlives=True),
    Level(name="24h", span_s=86400, step_s=600, outlives=True),
)
"""The finest first; each one's step is a whole number of the one's before it."""


def level_for(span_s: float) -> int:
    """Return which level shows a span best: the finest that goes back so far."""
    return next(
        (number for number, level in enumerate(LEVELS) if span_s <= level.span_s), len(LEVELS) - 1
    )
