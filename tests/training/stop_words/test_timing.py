"""Words are timed by their sounds, or by where a clip falls silent; a guess is never made."""

import numpy as np
import pytest

from training.stop_words.timing import sounding, word_times
from training.voices.clip import RATE_HZ, Sound, SpokenClip


def clip(text: str, phones: str = "", duration_s: float = 1.0) -> SpokenClip:
    samples = np.zeros(round(duration_s * RATE_HZ), np.float32)
    samples[RATE_HZ // 10 : -RATE_HZ // 5] = 0.2
    sounds = tuple(
        Sound(phone=phone, began_s=0.1 * number) for number, phone in enumerate(phones.split())
    )
    return SpokenClip(text=text, engine="e", voice="v", samples=samples, sounds=sounds)


def test_a_word_lasts_from_its_first_sound_to_the_one_after_it() -> None:
    said = clip("robot stop now", "r s t aa p n aw")
    assert word_times(said, "stop", is_last=False) == [pytest.approx((0.1, 0.5))]


def test_each_time_a_word_is_said_is_found() -> None:
    said = clip("halt, halt!", "hh ao l t pau hh ao l t")
    assert len(word_times(said, "halt", is_last=True)) == 2


def test_sounds_that_do_not_fit_the_text_give_no_times() -> None:
    assert word_times(clip("please freeze", "p l iy z"), "freeze", is_last=True) == []


def test_without_sounds_a_last_word_ends_with_the_clip() -> None:
    ((_, end_s),) = word_times(clip("please stop"), "stop", is_last=True)
    assert end_s == pytest.approx(0.8, abs=0.02)
    assert word_times(clip("just stop it"), "stop", is_last=False) == []
    assert word_times(clip("stop, stop"), "stop", is_last=True) == []


def test_a_last_word_that_is_said_slowly_begins_sooner() -> None:
    ((usual_s, _),) = word_times(clip("robot, halt"), "halt", is_last=True)
    ((start_s, end_s),) = word_times(clip("robot, halt", duration_s=2.1), "halt", is_last=True)
    assert usual_s == pytest.approx(0.35, abs=0.02)
    assert (start_s, end_s) == pytest.approx((1.9 - 1.8 * 4 / 9, 1.9), abs=0.02)


def test_without_sounds_a_first_word_begins_with_the_clip() -> None:
    ((start_s, end_s),) = word_times(clip("stop it please"), "stop", is_last=False)
    assert (start_s, end_s) == pytest.approx((0.1, 0.45), abs=0.02)


def test_silence_at_both_ends_is_no_sound() -> None:
    first, end = sounding(clip("stop").samples)
    assert (first / RATE_HZ, end / RATE_HZ) == pytest.approx((0.1, 0.8), abs=0.011)
