"""Let a voice sound in a room: an impulse response drawn anew, statistical, not of a real room."""

import numpy as np

from training.voices.clip import RATE_HZ, Wave


def draw_room(random: np.random.Generator) -> Wave:
    """Return the impulse response of a room; its first sample is the direct sound.

    Early echoes come at random within 40 ms; the tail decays by 60 dB in 0.15 to 0.8 s, high tones
    faster. The direct sound is as strong as all the rest together at 1 m, weaker farther away.
    """
    decay_s = random.uniform(0.15, 0.8)
    count = int(0.8 * decay_s * RATE_HZ)
    times_s = np.arange(count) / RATE_HZ
    tail = random.standard_normal(count) * 10.0 ** (-3.0 * times_s / decay_s)
    dulled = np.convolve(tail, np.ones(4) / 4, mode="same")
    share = np.minimum(times_s / decay_s, 1.0)
    tail = (1 - share) * tail + share * dulled
    tail[: int(0.004 * RATE_HZ)] = 0.0
    for _ in range(int(random.integers(3, 9))):
        tail[int(random.uniform(0.002, 0.04) * RATE_HZ)] += random.normal(0.0, 1.5)
    power = float(np.sum(tail**2))
    direct_ratio_db = random.uniform(-4.0, 12.0)
    response = tail * np.sqrt(10.0 ** (-direct_ratio_db / 10.0) / max(power, 1e-9))
    response[0] = 1.0
    made: Wave = response.astype(np.float32)
    return made


def in_room(samples: Wave, response: Wave) -> Wave:
    """Return what is heard in the room, as long as the samples, at the same moments."""
    length = 1 << (len(samples) + len(response) - 1).bit_length()
    spectrum = np.fft.rfft(samples, length) * np.fft.rfft(response, length)
    heard: Wave = np.fft.irfft(spectrum, length)[: len(samples)].astype(np.float32)
    return heard
