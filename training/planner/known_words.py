"""List the words that training shows often: any other is strange to the model."""

from collections import Counter
from random import Random
from typing import Final

from training.planner.composing import Composer

_EXAMPLES: Final = 40_000
_LEAST: Final = 4
_SEED: Final = 77


def known_words(composer: Composer, examples: int = _EXAMPLES) -> list[str]:
    """Return words in the order of the alphabet; invented ones come up too seldom."""
    random = Random(_SEED)
    counts: Counter[str] = Counter()
    for _ in range(examples):
        counts.update(composer.example(random).command.split())
    return sorted(word for word, count in counts.items() if count >= _LEAST)
