"""Hold one spoken text: its samples, and when each of its sounds begins."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

RATE_HZ: Final = 16_000
"""Of all sound in training."""
Wave = NDArray[np.float32]
"""Mono samples as a share of full scale, -1 to 1, at RATE_HZ."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Say how to speak: `rate_ratio` and `pitch_ratio` to the voice's own, `lively` 0 to 1.

    An engine does what it can of it: flite's statistical voices keep their own pace.
    """

    rate_ratio: float = 1.0
    pitch_ratio: float = 1.0
    lively: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Sound:
    """Say which sound of speech begins when; `phone` is one of training.voices.phones.PHONES."""

    phone: str
    began_s: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpokenClip:
    """Hold a spoken text; `sounds` is empty where the engine does not tell them."""

    text: str
    engine: str
    voice: str
    samples: Wave
    sounds: tuple[Sound, ...] = ()

    @property
    def duration_s(self) -> float:
        """Return how long it lasts."""
        return len(self.samples) / RATE_HZ


def resample(samples: Wave, rate_hz: int) -> Wave:
    """Bring samples of another rate to RATE_HZ, without aliases."""
    if rate_hz == RATE_HZ:
        return samples
    count = round(len(samples) * RATE_HZ / rate_hz)
    # A whole multiple of both rates in the transform's length keeps the ratio exact.
    step = rate_hz // int(np.gcd(rate_hz, RATE_HZ))
    padded = -(-len(samples) // step) * step
    target = padded * RATE_HZ // rate_hz
    spectrum = np.fft.rfft(samples, padded)[: target // 2 + 1]
    if len(spectrum) < target // 2 + 1:
        spectrum = np.pad(spectrum, (0, target // 2 + 1 - len(spectrum)))
    made = np.fft.irfft(spectrum, target)[:count] * (target / padded)
    return made.astype(np.float32)
