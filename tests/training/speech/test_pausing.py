import numpy as np

from training.speech.clips.pausing import HESITATIONS, hesitating, with_pauses
from training.speech.clips.sentences import draw_sentence, normal


def test_a_pause_changes_no_word() -> None:
    random = np.random.default_rng(1)
    texts = [draw_sentence(random) for _ in range(300)]
    assert [normal(with_pauses(text, random)) for text in texts] == texts


def test_about_half_of_the_sentences_pause_and_none_at_its_end() -> None:
    random = np.random.default_rng(2)
    told = [with_pauses("robot go to the kitchen and wait there", random) for _ in range(400)]
    paused = [one for one in told if any(mark in one for mark in ",.;")]
    assert 0.3 < len(paused) / len(told) < 0.6
    assert all(one[-1].isalpha() for one in told)


def test_somebody_who_hesitates_says_all_the_same_words_and_others_between() -> None:
    random = np.random.default_rng(3)
    words = ["bring", "me", "the", "red", "cup"]
    for _ in range(100):
        said = hesitating(" ".join(words), random).split()
        left = iter(said)
        assert all(word in left for word in words)
        assert len(said) > len(words)


def test_a_pause_is_before_and_after_a_hesitation_more_often_than_not() -> None:
    random = np.random.default_rng(4)
    told = [with_pauses("give me the um cup", random) for _ in range(400)]
    assert "um" in HESITATIONS
    assert sum("the," in one or "the;" in one or "the." in one for one in told) > 120
