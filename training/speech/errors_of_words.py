"""Count what a reading got wrong: words put in, left out, and exchanged."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from training.speech.clips.sentences import normal


@dataclass(frozen=True, slots=True, kw_only=True)
class Count:
    """Hold counts over many readings."""

    texts: int
    exact: int
    words: int
    wrong: int

    @property
    def error_ratio(self) -> float:
        """Return the word error rate: wrong words over words said; 0 where nothing was said."""
        return self.wrong / self.words if self.words else 0.0

    @property
    def exact_ratio(self) -> float:
        """Return the share of texts without an error."""
        return self.exact / self.texts if self.texts else 0.0


def count(pairs: Iterable[tuple[str, str]]) -> Count:
    """Count over pairs of what was said and what was read; case and punctuation do not matter."""
    texts = exact = words = wrong = 0
    for said, read in pairs:
        expected, got = normal(said).split(), normal(read).split()
        distance = edits(expected, got)
        texts, words = texts + 1, words + len(expected)
        exact, wrong = exact + (distance == 0), wrong + distance
    return Count(texts=texts, exact=exact, words=words, wrong=wrong)


def edits(expected: Sequence[str], got: Sequence[str]) -> int:
    """Return the least number of words to put in, leave out or exchange."""
    row = list(range(len(got) + 1))
    for number, word in enumerate(expected, start=1):
        before, row[0] = row[0], number
        for place, other in enumerate(got, start=1):
            change = before + (word != other)
            before = row[place]
            row[place] = min(change, row[place] + 1, row[place - 1] + 1)
    return row[-1]
