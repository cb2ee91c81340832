"""Say how much is spoken and how long is learnt; the smallest size only checks that all works."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class StopWordSettings:
    """Hold what decides the result besides the code.

    `scale` is the share of the clips that are spoken, `cpu_minutes` how long is learnt on one core.
    A batch has `fresh` stretches and some that were `seen` before, varied.
    """

    name: str
    seed: int = 0
    scale: float = 1.0
    cpu_minutes: float = 60.0
    fresh: int = 2
    seen: int = 18
    stretch_s: float = 7.5
    learning_rate: float = 3e-3
    judged_hours: float = 3.0
    judged_stops: int = 400
    start_from: Path | None = None
    """The exported model to go on from, else from random weights."""

    @property
    def highest_rate(self) -> float:
        """Return the highest learning rate: what is learnt already is not to be shaken up."""
        return self.learning_rate if self.start_from is None else self.learning_rate / 3.0


FULL = StopWordSettings(name="full")
"""What the shipped model was made by."""
TINY = StopWordSettings(
    name="tiny", scale=0.01, cpu_minutes=0.2, fresh=2, seen=2, judged_hours=0.02, judged_stops=8
)
SIZES = {settings.name: settings for settings in (FULL, TINY)}
