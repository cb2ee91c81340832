"""Ask a recogniser how likely a stop word was said in place of a word that it read.

Its search follows a handful of readings and drops the others: a "halt" in noise is read as "hope",
and never comes up. Asked for it, the decoder often finds it nearly as likely.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from vla_deploy.speech.words import STOPS, holds_stop

ASKED_FROM: Final = 0.3
"""Whoever listens for stop words alone has to be so sure first: asking takes 10 to 30 ms."""
MOST_WORDS: Final = 8
"""Of a long phrase only the last ones are asked about: what was said before is decided."""
LogProbabilities = Callable[[Sequence[str]], list[float]]


def with_stop(text: str) -> list[str]:
    """Return each text in which a stop word stands for one of the last words, or for nothing."""
    words = text.split() or [""]
    texts = []
    for place in range(max(0, len(words) - MOST_WORDS), len(words)):
        comma = "," if words[place].endswith(",") else ""
        texts += [
            " ".join((*words[:place], stop + comma, *words[place + 1 :])) for stop in sorted(STOPS)
        ]
    return texts


def stop_odds(text: str, log_probabilities: LogProbabilities) -> float:
    """Return the probability of the likeliest such text over that of the one that was read.

    From 0 to 1; a text that holds a stop word has 1. `log_probabilities` gives those of texts.
    """
    if holds_stop(text):
        return 1.0
    read, *others = log_probabilities([text, *with_stop(text)])
    return math.exp(min(0.0, max(others) - read))
