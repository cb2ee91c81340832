"""Let somebody have spoken before: on board the ear hears what was said just before, too."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from training.voices.clip import RATE_HZ, Wave

SHARE: Final = 0.35
"""Of clips before which somebody has spoken, with a stop word in them or without: neither is told
by what was before."""
ANOTHER_SHARE: Final = 0.3
"""Of these, those in which it was any voice, perhaps the robot's, louder or softer."""
GAIN_DB: Final = (-12.0, 12.0)
LENGTH_S: Final = (0.4, 3.0)
PAUSE_S: Final = (0.1, 1.0)
LONG_LEAD_SHARE: Final = 0.25
"""Of the other clips, those before which there was nothing for longer."""
LEAD_S: Final = (0.0, 0.5)
LONG_LEAD_S: Final = (0.5, 3.0)
Random = np.random.Generator


@dataclass(frozen=True, slots=True)
class Before:
    """Say what comes before a clip: nothing for a while, or the end of another one, and a pause.

    `number` is that of the other clip, None for nothing.
    """

    number: int | None
    spoken_s: float
    silent_s: float
    gain_db: float = 0.0

    @property
    def most_s(self) -> float:
        """Return how long it lasts at most: the other clip may be shorter."""
        return self.spoken_s + self.silent_s


class Preceding:
    """Draw what was said before a clip, mostly by the same voice."""

    def __init__(self, voices: Sequence[str], wave_of: Callable[[int], Wave]) -> None:
        """Take the voice of each clip of talk, and what returns its sound by its number."""
        self._wave_of = wave_of
        self._count = len(voices)
        self._numbers: dict[str, list[int]] = defaultdict(list)
        for number, voice in enumerate(voices):
            self._numbers[voice].append(number)

    def draw(self, voice: str, random: Random) -> Before:
        """Draw what comes before a clip of a voice; nothing where it has said nothing else."""
        numbers: Sequence[int] = self._numbers.get(voice, [])
        if numbers and random.random() < SHARE:
            is_other = random.random() < ANOTHER_SHARE
            numbers = range(self._count) if is_other else numbers
            number = numbers[int(random.integers(len(numbers)))]
            gain_db = random.uniform(*GAIN_DB) if is_other else 0.0
            return Before(number, random.uniform(*LENGTH_S), random.uniform(*PAUSE_S), gain_db)
        lead_s = LONG_LEAD_S if random.random() < LONG_LEAD_SHARE else LEAD_S
        return Before(None, 0.0, random.uniform(*lead_s))

    def wave(self, before: Before) -> Wave:
        """Return its sound."""
        silence = round(RATE_HZ * before.silent_s)
        if before.number is None:
            return np.zeros(silence, np.float32)
        spoken = self._wave_of(before.number)[-round(RATE_HZ * before.spoken_s) :]
        return np.pad(spoken * np.float32(10.0 ** (before.gain_db / 20.0)), (0, silence))
