"""A word is put amid words of other talk as told, and these are drawn anew each time."""

import numpy as np
import pytest

from training.stop_words.amid_talk import COMMA_SHARE, MOST_AFTER, MOST_BEFORE, amid_talk

TALK = ("he didn't see, the red door", "up the hill", "rain")
PLACES = ((True, False), (False, True), (True, True))


@pytest.mark.parametrize(("before", "after"), PLACES)
def test_it_stands_where_it_was_told(before: bool, after: bool) -> None:
    random = np.random.default_rng(0)
    spoken = [one.replace(",", "") for one in TALK]
    for _ in range(100):
        text = amid_talk("halt", random, TALK, before=before, after=after)
        words = text.replace(",", "").split()
        place = words.index("halt")
        first, last = words[:place], words[place + 1 :]
        assert (0 < len(first) <= MOST_BEFORE) if before else not first
        assert (0 < len(last) <= MOST_AFTER) if after else not last
        assert all(any(" ".join(some) in one for one in spoken) for some in (first, last))


def test_the_words_around_it_differ_and_some_are_set_off() -> None:
    random = np.random.default_rng(1)
    texts = [amid_talk("halt", random, TALK, before=True, after=False) for _ in range(200)]
    assert len(set(texts)) > 20
    share = np.mean([", halt" in text for text in texts])
    assert abs(share - COMMA_SHARE) < 0.1
