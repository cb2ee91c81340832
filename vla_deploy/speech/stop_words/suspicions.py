"""Remember where a stop word may have been said, though too unsurely to stop for it alone."""

from collections import deque
from collections.abc import Mapping
from typing import Final

from drivers.clock import NS_PER_S

KEPT_NS: Final = 12 * NS_PER_S
SETTLES_NS: Final = 6 * NS_PER_S // 10
"""A word that ends a phrase is settled so long after it at most."""

ALONE_SHARE: Final[Mapping[str, float]] = {"low": 0.6}
"""How far above its threshold a word must come to stop the robot by itself, as a share of what is
left to certainty, by sensitivity: at "low" the recogniser judges what is less sure."""


def alone(sensitivity: str, threshold: float) -> float:
    """Return the score from which on a word stops the robot whatever the recogniser reads."""
    return threshold + ALONE_SHARE.get(sensitivity, 0.0) * (1.0 - threshold)


class Suspicions:
    """Hold scores over the threshold in force, each with the end of the sound that settled it."""

    def __init__(self) -> None:
        self._told: deque[tuple[int, float]] = deque()

    def note(self, stamp_ns: int, score: float, threshold: float) -> None:
        """Take the newest score."""
        self._told.append((stamp_ns, score / threshold))
        while self._told[0][0] < stamp_ns - KEPT_NS:
            self._told.popleft()

    def highest(self, began_ns: int, ended_ns: int) -> float:
        """Return how near the threshold came what was said from then to then; 0 if nothing was."""
        return max(
            (ratio for at, ratio in self._told if began_ns <= at <= ended_ns + SETTLES_NS),
            default=0.0,
        )

    def clear(self) -> None:
        """Forget all: what follows has nothing to do with it."""
        self._told.clear()
