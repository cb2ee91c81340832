"""Say where a speaker pauses: marks of punctuation for the voices, commas for the recogniser.

People pause before "and", around an "um", after a name, and where they think. A recogniser that
has heard no pause within a sentence takes the first one for the end. It writes a comma where it
hears one: "pick up the red cup, no, the blue one" is hard to understand without.
"""

import re
from typing import Final

import numpy as np

Random = np.random.Generator

PAUSES_CHANCE: Final = 0.55
"""Of a sentence to have any pause."""
_MARKS: Final = (",", ".", ";")
_MARK_SHARES: Final = (0.75, 0.15, 0.1)
_BEFORE: Final = frozenset({"and", "then", "but", "after", "so", "or", "please", "the", "in"})
_AFTER: Final = frozenset({"robot", "butler", "okay", "please", "yes", "no", "well", "right"})
_BEFORE_CHANCE: Final = {"the": 0.08, "in": 0.1}
_AT_JOINT_CHANCE: Final = 0.55
_ANYWHERE_CHANCE: Final = 0.05
HESITATIONS: Final = (
    "um", "uh", "er", "hmm", "ah", "well", "you know", "i mean", "let me see", "no wait",
    "what is it called", "what's it called", "how do you say", "that is", "sorry", "wait",
)  # fmt: skip
_AROUND_CHANCE: Final = 0.8


def with_pauses(text: str, random: Random) -> str:
    """Return a text with marks where its speaker pauses; its words are the same."""
    words = text.split()
    if random.random() >= PAUSES_CHANCE:
        return text
    around = _hesitating(words)
    said = []
    for at, word in enumerate(words):
        pauses = at + 1 < len(words) and random.random() < _chance(words, at, around)
        said.append(word + str(random.choice(_MARKS, p=_MARK_SHARES)) if pauses else word)
    return " ".join(said)


def as_read(text: str) -> str:
    """Return a text with marks as the recogniser is to write it: each a comma."""
    return re.sub(r"[.;]", ",", text)


def hesitating(text: str, random: Random) -> str:
    """Return a text of somebody who hesitates once or twice, or says a word again."""
    words = text.split()
    for _ in range(int(random.integers(1, 3))):
        at = int(random.integers(0, len(words)))
        again = random.random() < 0.15
        filler = words[at] if again else str(random.choice(HESITATIONS))
        words[at:at] = filler.split()
    return " ".join(words)


def _chance(words: list[str], at: int, around: frozenset[int]) -> float:
    """Return how probably there is a pause after a word."""
    if at in around:
        return _AROUND_CHANCE
    following = words[at + 1]
    if words[at] in _AFTER or following in _BEFORE:
        return _BEFORE_CHANCE.get(following, _AT_JOINT_CHANCE)
    return _ANYWHERE_CHANCE


def _hesitating(words: list[str]) -> frozenset[int]:
    """Return the places after which a hesitation begins or ends."""
    found = set()
    for filler in HESITATIONS:
        parts = filler.split()
        for at in range(len(words) - len(parts) + 1):
            if words[at : at + len(parts)] == parts:
                found |= {at - 1, at + len(parts) - 1}
    return frozenset(found)
