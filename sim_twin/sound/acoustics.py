"""Say what becomes of a sound on its way through a room: delay, distance, and the walls' answer.

A path is an impulse response: the direct sound, weaker by distance, then a tail of reflections that
dies away by 60 dB within the reverberation time. The tail is as strong everywhere in the room; at
the critical distance it carries as much as the direct sound. That is the diffuse-field model of
room acoustics: short, and right in what a recogniser suffers from.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.audio.clip import Wave

SPEED_OF_SOUND_M_S: Final = 343.0
NEAREST_M: Final = 0.1
FIRST_REFLECTION_S: Final = 0.004
_TO_60_DB: Final = float(np.log(10.0**3))  # of amplitude


@dataclass(frozen=True, slots=True, kw_only=True)
class Acoustics:
    """Describe a furnished room, and how a person and the robot's speaker sound in it.

    `critical_distance_m` holds for somebody who faces the robot. `talker_rms` is a person's voice
    at 1 m, as a share of the microphone's full scale; `speaker_gain` is the speaker's at 1 m, for a
    full-scale signal.
    """

    reverberation_s: float = 0.25
    critical_distance_m: float = 1.5
    talker_rms: float = 0.05
    speaker_gain: float = 0.25
    speaker_distance_m: float = 0.3


def path(distance_m: float, rate_hz: int, acoustics: Acoustics, seed: int) -> Wave:
    """Return the impulse response over a distance, 1 being the direct sound at 1 m."""
    distance_m = max(distance_m, NEAREST_M)
    direct = round(distance_m / SPEED_OF_SOUND_M_S * rate_hz)
    tail = _tail(rate_hz, acoustics, seed)
    begins = direct + round(FIRST_REFLECTION_S * rate_hz)
    response = np.zeros(begins + len(tail), np.float32)
    response[begins:] = tail
    response[direct] = 1.0 / distance_m
    return response


def through(wave: Wave, response: Wave) -> Wave:
    """Return what arrives of a sound at the end of a path, its tail included."""
    rows = len(wave) + len(response) - 1
    size = 1 << (rows - 1).bit_length()
    arrived: NDArray[np.float64] = np.fft.irfft(
        np.fft.rfft(wave, size) * np.fft.rfft(response, size), size
    )
    return arrived[:rows].astype(np.float32)


def _tail(rate_hz: int, acoustics: Acoustics, seed: int) -> Wave:
    """Return decaying noise with the energy that the direct sound has at the critical distance."""
    rows = round(acoustics.reverberation_s * rate_hz)
    times_s = np.arange(rows) / rate_hz
    noise = np.random.default_rng(seed).standard_normal(rows)
    tail = noise * np.exp(-_TO_60_DB * times_s / acoustics.reverberation_s)
    tail /= max(float(np.linalg.norm(tail)), 1e-12) * acoustics.critical_distance_m
    return tail.astype(np.float32)
