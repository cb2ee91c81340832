"""Before a clip there is the same voice or another, or nothing, whatever is in the clip."""

import numpy as np

from training.stop_ear.preceding import LONG_LEAD_S, SHARE, Preceding
from training.voices.clip import RATE_HZ

VOICES = ("a", "a", "b")
SECOND = RATE_HZ


def preceding() -> Preceding:
    return Preceding(VOICES, lambda number: np.full(2 * SECOND, 0.1 * (number + 1), np.float32))


def test_a_voice_has_mostly_spoken_itself_or_not_at_all() -> None:
    random = np.random.default_rng(0)
    drawn = [preceding().draw("b", random) for _ in range(2000)]
    spoken = [one for one in drawn if one.number is not None]
    assert abs(len(spoken) / len(drawn) - SHARE) < 0.05
    own = [one for one in spoken if one.gain_db == 0.0]
    assert 0.6 < len(own) / len(spoken) < 0.8
    assert {one.number for one in own} == {2}
    assert {one.number for one in spoken} == {0, 1, 2}


def test_a_voice_that_says_nothing_else_has_not_spoken() -> None:
    random = np.random.default_rng(1)
    drawn = [preceding().draw("nobody", random) for _ in range(200)]
    assert {one.number for one in drawn} == {None}
    assert 0.5 < max(one.silent_s for one in drawn) <= LONG_LEAD_S[1]


def test_its_sound_is_the_end_of_a_clip_and_a_pause() -> None:
    random, source = np.random.default_rng(2), preceding()
    for _ in range(50):
        before = source.draw("a", random)
        wave = source.wave(before)
        silence = round(RATE_HZ * before.silent_s)
        assert len(wave) - silence == min(2 * SECOND, round(RATE_HZ * before.spoken_s))
        assert not wave[len(wave) - silence :].any()
        assert np.all(wave[: len(wave) - silence] != 0.0)
