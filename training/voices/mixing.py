"""Mix speech and noise at a ratio of their powers."""

from typing import Final

import numpy as np

from training.voices.clip import RATE_HZ, Wave

_FRAME: Final = RATE_HZ // 50
_FLOOR_DB: Final = -40.0


def speech_power(samples: Wave) -> float:
    """Return the mean power of the 20 ms frames that hold speech, pauses left out.

    Speech is what lies within 40 dB of the loudest frame; 0 for silence.
    """
    whole = samples[: len(samples) // _FRAME * _FRAME].reshape(-1, _FRAME)
    if not len(whole):
        return 0.0
    powers = np.mean(np.square(whole, dtype=np.float64), axis=1)
    loud = powers[powers >= powers.max() * 10.0 ** (_FLOOR_DB / 10.0)]
    return float(loud.mean())


def at_snr(speech: Wave, noise: Wave, snr_db: float) -> Wave:
    """Return speech with noise, their powers `snr_db` apart; the speech keeps its level.

    Raises:
        ValueError: the two are not of one length.
    """
    if len(speech) != len(noise):
        raise ValueError(f"mixing: {len(speech)} samples of speech, {len(noise)} of noise")
    noise_power = float(np.mean(np.square(noise, dtype=np.float64)))
    if noise_power == 0.0:
        return speech
    gain = np.sqrt(speech_power(speech) / noise_power * 10.0 ** (-snr_db / 10.0))
    return (speech + np.float32(gain) * noise).astype(np.float32)


def at_level(samples: Wave, level_db: float) -> Wave:
    """Scale speech to a level (dB of full scale, of its speech alone), clipped at full scale."""
    power = speech_power(samples)
    if power == 0.0:
        return samples
    gain = np.float32(10.0 ** (level_db / 20.0) / np.sqrt(power))
    scaled: Wave = np.clip(samples * gain, -1.0, 1.0).astype(np.float32)
    return scaled
