import numpy as np
import pytest

from training.voices.clip import RATE_HZ, resample
from training.voices.mixing import at_level, at_snr, speech_power
from training.voices.noises import KINDS, babble, noise
from training.voices.rooms import draw_room, in_room


def _tone(count: int, hertz: float = 440.0, rate_hz: int = RATE_HZ) -> np.ndarray:
    return np.sin(2 * np.pi * hertz * np.arange(count) / rate_hz).astype(np.float32)


def test_pauses_do_not_count_as_speech_when_noise_is_mixed_in() -> None:
    speech = np.concatenate([np.zeros(RATE_HZ, np.float32), _tone(RATE_HZ)])
    hiss = noise("white", len(speech), np.random.default_rng(0))
    added = at_snr(speech, hiss, 10.0) - speech
    assert 10 * np.log10(0.5 / np.mean(added**2)) == pytest.approx(10.0, abs=0.01)


def test_speech_and_noise_of_different_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="8 samples of speech, 9 of noise"):
        at_snr(np.ones(8, np.float32), np.ones(9, np.float32), 0.0)


def test_level_is_that_of_the_speech_and_never_above_full_scale() -> None:
    assert speech_power(at_level(_tone(RATE_HZ), -20.0)) == pytest.approx(0.01, rel=1e-3)
    assert np.abs(at_level(_tone(RATE_HZ), 6.0)).max() == 1.0
    assert not at_level(np.zeros(RATE_HZ, np.float32), -20.0).any()


@pytest.mark.parametrize("kind", KINDS)
def test_noise_is_seeded_of_unit_power_and_of_the_length_asked_for(kind: str) -> None:
    first, again = (noise(kind, 12_345, np.random.default_rng(3)) for _ in range(2))
    assert first.shape == (12_345,) and np.array_equal(first, again)
    assert np.mean(first**2) == pytest.approx(1.0, rel=1e-3)


def test_babble_takes_talk_of_any_length() -> None:
    talk = [_tone(100), _tone(50_000, 300.0), np.zeros(0, np.float32)]
    assert babble(talk, 16_000, np.random.default_rng(1)).shape == (16_000,)


def test_a_room_keeps_the_moment_of_the_direct_sound_and_rings_on() -> None:
    click = np.zeros(RATE_HZ, np.float32)
    click[1000] = 1.0
    heard = in_room(click, draw_room(np.random.default_rng(5)))
    assert heard[1000] == pytest.approx(1.0, abs=1e-4)
    assert np.abs(heard[:999]).max() < 1e-4 < np.abs(heard[2000:3000]).max()


def test_resampling_keeps_the_tone_and_its_level() -> None:
    made = resample(_tone(22_050 * 2, rate_hz=22_050), 22_050)
    assert len(made) == 2 * RATE_HZ
    assert np.abs(made - _tone(2 * RATE_HZ))[200:-200].max() < 0.02
