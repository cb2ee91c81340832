"""Decide which frames of a wire are lost, damaged or late, reproducibly from a seed."""

import random

from drivers.clock import NS_PER_S


class FrameTamper:
    """Judge frame by frame; nothing is wrong until it is asked for."""

    def __init__(self) -> None:
        self.delay_ns = 0
        self._drop_every = 0
        self._since_dropped = 0
        self._drop_ratio = 0.0
        self._corrupt_ratio = 0.0
        self._drop_random = random.Random(0)
        self._corrupt_random = random.Random(0)

    @property
    def idle(self) -> bool:
        """Return whether nothing is wrong."""
        return not (self.delay_ns or self._drop_every or self._drop_ratio or self._corrupt_ratio)

    def drop_every(self, count: int) -> None:
        """Lose every `count`-th frame; 0 loses none."""
        if count < 0:
            raise ValueError(f"drop_every: {count} frames, expected 0 or more")
        self._drop_every = count
        self._since_dropped = 0

    def drop_ratio(self, ratio: float, seed: int) -> None:
        """Lose this share of the frames."""
        self._drop_ratio = _ratio("drop_ratio", ratio)
        self._drop_random = random.Random(seed)

    def corrupt_ratio(self, ratio: float, seed: int) -> None:
        """Damage this share of the attempts to send a frame."""
        self._corrupt_ratio = _ratio("corrupt", ratio)
        self._corrupt_random = random.Random(seed)

    def delay(self, seconds: float) -> None:
        """Hand every frame on this much later."""
        if seconds < 0.0:
            raise ValueError(f"delay: {seconds} s, expected 0 or more")
        self.delay_ns = round(seconds * NS_PER_S)

    def loses(self) -> bool:
        """Return whether the next frame is lost."""
        if self._drop_every:
            self._since_dropped = (self._since_dropped + 1) % self._drop_every
            if not self._since_dropped:
                return True
        return self._drop_ratio > 0.0 and self._drop_random.random() < self._drop_ratio

    def damages(self) -> bool:
        """Return whether the next attempt is damaged."""
        return self._corrupt_ratio > 0.0 and self._corrupt_random.random() < self._corrupt_ratio


def _ratio(what: str, ratio: float) -> float:
    if not 0.0 <= ratio <= 1.0:
        raise ValueError(f"{what}: ratio {ratio}, expected 0..1")
    return ratio
