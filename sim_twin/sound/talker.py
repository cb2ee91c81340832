"""Let a synthetic person speak: words by eSpeak NG, as they arrive at the robot's microphone."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from drivers.audio.clip import Clip, Wave
from drivers.audio.espeak import EspeakEngine
from sim_twin.sound.acoustics import Acoustics, path, through

USUAL_DISTANCE_M: Final = 1.5
NOISE_AROUND_S: Final = 0.5
"""A stated noise begins before the words and ends after them."""
_FRAME_S: Final = 0.02
_SILENCE_RATIO: Final = 10.0 ** (-35.0 / 20.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Talker:
    """Be somebody in the room: a voice, and how far from the robot's microphone."""

    engine: EspeakEngine = field(default_factory=EspeakEngine)
    distance_m: float = USUAL_DISTANCE_M


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Arrival:
    """Hold what arrives at the microphone; `words` are the rows in which words sound."""

    sound: Clip
    words: tuple[int, int]


def arrival(
    text: str,
    talker: Talker,
    rate_hz: int,
    acoustics: Acoustics,
    *,
    snr_db: float | None = None,
    seed: int = 0,
) -> Arrival:
    """Return how a text sounds at the microphone, over noise of its own where an SNR is asked.

    The signal-to-noise ratio is that of the words as they arrive, reverberation included, to noise
    that falls with frequency as that of rooms does.

    Raises:
        VoiceError: the talker's words do not become sound.
    """
    dry = _levelled(_trimmed(talker.engine.synthesise(text).at_rate(rate_hz)), acoustics.talker_rms)
    response = path(talker.distance_m, rate_hz, acoustics, seed)
    wet = through(dry.wave, response)
    delay = int(np.flatnonzero(response)[0])
    words = (delay, delay + len(dry.wave))
    if snr_db is None:
        return Arrival(sound=Clip(rate_hz=rate_hz, wave=wet), words=words)
    around = round(NOISE_AROUND_S * rate_hz)
    wave = _room_noise(len(wet) + 2 * around, seed + 1)
    wave *= loudness(Clip(rate_hz=rate_hz, wave=wet)) * 10.0 ** (-snr_db / 20.0)
    wave[around : around + len(wet)] += wet
    return Arrival(
        sound=Clip(rate_hz=rate_hz, wave=wave), words=(words[0] + around, words[1] + around)
    )


def loudness(sound: Clip) -> float:
    """Return the effective value of a sound where it is no silence, as a share of full scale."""
    powers = _frame_powers(sound)
    loud = powers[powers > _SILENCE_RATIO**2 * powers.max(initial=0.0)]
    return float(np.sqrt(loud.mean())) if len(loud) else 0.0


def _frame_powers(sound: Clip) -> Wave:
    rows = round(_FRAME_S * sound.rate_hz)
    whole = len(sound.wave) - len(sound.wave) % rows
    powers: Wave = (sound.wave[:whole].reshape(-1, rows) ** 2).mean(axis=1)
    return powers


def _trimmed(sound: Clip) -> Clip:
    """Return the words alone: programs put silence around them."""
    powers = _frame_powers(sound)
    loud = np.flatnonzero(powers > _SILENCE_RATIO**2 * powers.max(initial=0.0))
    if not len(loud):
        return sound
    rows = round(_FRAME_S * sound.rate_hz)
    kept = sound.wave[loud[0] * rows : (loud[-1] + 1) * rows]
    return Clip(rate_hz=sound.rate_hz, wave=kept)


def _levelled(sound: Clip, rms: float) -> Clip:
    loud = loudness(sound)
    gain = np.float32(rms / loud if loud else 0.0)
    return Clip(rate_hz=sound.rate_hz, wave=sound.wave * gain)


def _room_noise(rows: int, seed: int) -> Wave:
    """Return noise of effective value 1 whose power falls by 3 dB with each octave."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(rows))
    spectrum /= np.sqrt(np.maximum(np.arange(len(spectrum)), 1.0))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, rows)
    return (noise / max(float(np.std(noise)), 1e-12)).astype(np.float32)
