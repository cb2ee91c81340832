"""Make what lies between a mouth and the samples: rooms, microphones, noise, music, babble."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from training.stop_words.corpus import Clips
from training.stop_words.picking import pick
from training.voices.clip import RATE_HZ
from vla_deploy.speech.stop_words.features import log_mel

Sound = NDArray[np.float32]
BANK_S: Final = 60
_TAIL_S: Final = 0.6
_LEVEL: Final = 0.05


class NoiseBank:
    """Hold a minute of each kind of noise, all equally loud; babble is made of other talk."""

    def __init__(self, others: Clips, random: np.random.Generator) -> None:
        count = BANK_S * RATE_HZ
        sounds = [
            *(_coloured(count, slope, random) for slope in (0.0, 0.5, 1.0, 1.5, 2.0)),
            *(_babble(others, count, voices, random) for voices in (2, 3, 5, 8)),
            *(_music(count, random) for _ in range(3)),
            _motors(count, random),
            _motors(count, random),
            _knocks(count, random),
        ]
        self.sounds = [sound / np.sqrt(np.mean(sound**2)) for sound in sounds]

    def take(self, count: int, random: np.random.Generator) -> Sound:
        """Return a stretch of one kind, of mean power 1 over the whole bank's minute."""
        sound = pick(self.sounds, random)
        start = int(random.integers(len(sound) - count))
        return sound[start : start + count]


class NoiseFrames:
    """Hold the same noises as frames, for stretches that are frames already."""

    def __init__(self, bank: NoiseBank) -> None:
        self._noises = [log_mel(np.float32(_LEVEL) * sound) for sound in bank.sounds]

    def take(self, count: int, random: np.random.Generator) -> NDArray[np.float32]:
        """Return so many frames of one kind."""
        frames: NDArray[np.float32] = pick(self._noises, random)
        start = int(random.integers(len(frames) - count))
        return frames[start : start + count]


def in_a_room(sound: Sound, random: np.random.Generator) -> Sound:
    """Return sound as a microphone of any kind hears it in a room of any kind."""
    tail = round(_TAIL_S * RATE_HZ)
    size = 1 << (len(sound) + tail - 1).bit_length()
    spectrum = np.fft.rfft(sound, size) * _microphone(size, random)
    if random.random() < 0.6:
        spectrum *= np.fft.rfft(_echo(tail, random), size)
    heard: Sound = np.fft.irfft(spectrum, size)[: len(sound)].astype(np.float32)
    return heard


def _echo(count: int, random: np.random.Generator) -> Sound:
    """Return the answer of a room: the direct sound, and a tail that dies out."""
    decay_s = random.uniform(0.1, 0.7)  # until 60 dB less
    times_s = np.arange(count, dtype=np.float32) / RATE_HZ
    tail = random.standard_normal(count, np.float32) * np.exp(-6.9 * times_s / decay_s)
    tail[: round(random.uniform(0.001, 0.01) * RATE_HZ)] = 0.0
    direct_db = random.uniform(0.0, 18.0)
    tail *= 10.0 ** (-direct_db / 20.0) / np.sqrt(np.sum(tail**2))
    tail[0] = 1.0
    echo: Sound = tail
    return echo


def _microphone(size: int, random: np.random.Generator) -> NDArray[np.float32]:
    """Return how much of each frequency a microphone takes: a tilt, bumps, and its limits."""
    hz = np.fft.rfftfreq(size, 1.0 / RATE_HZ).astype(np.float32) + 1.0
    knots = np.array([20, 150, 400, 1_000, 2_500, 5_000, 8_001], np.float32)
    gains_db = random.normal(0.0, 3.0, len(knots)) + random.uniform(-3, 3) * np.log2(knots / 1000)
    if random.random() < 0.25:
        gains_db[-1] -= random.uniform(10, 40)  # a telephone's
    if random.random() < 0.25:
        gains_db[:2] -= random.uniform(5, 25)
    curve_db = np.interp(np.log(hz), np.log(knots), gains_db)
    return (10.0 ** (curve_db / 20.0)).astype(np.float32)


def _coloured(count: int, slope: float, random: np.random.Generator) -> Sound:
    spectrum = np.fft.rfft(random.standard_normal(count, np.float32))
    hz = np.maximum(np.fft.rfftfreq(count, 1.0 / RATE_HZ), 30.0)
    sound = np.fft.irfft(spectrum * hz**-slope, count).astype(np.float32)
    swell = 1.0 + 0.5 * np.sin(2 * np.pi * np.arange(count) / (RATE_HZ * random.uniform(2, 9)))
    return sound * swell.astype(np.float32)


def _babble(others: Clips, count: int, voices: int, random: np.random.Generator) -> Sound:
    total = np.zeros(count, np.float32)
    for _ in range(voices):
        place = 0
        while place < count:
            said = others[int(random.integers(len(others)))].samples.astype(np.float32)
            said /= np.sqrt(np.mean(said**2)) + 1.0
            end = min(count, place + len(said))
            total[place:end] += said[: end - place]
            place = end + int(random.integers(RATE_HZ // 2))
    return total


def _music(count: int, random: np.random.Generator) -> Sound:
    """Return chords of decaying notes with overtones, over a beat."""
    total = np.zeros(count, np.float32)
    beat = round(RATE_HZ * random.uniform(0.25, 0.6))
    for start in range(0, count - 2 * beat, beat):
        length = beat * int(random.integers(1, 3))
        times_s = np.arange(length, dtype=np.float32) / RATE_HZ
        for _ in range(int(random.integers(1, 5))):
            note_hz = 55.0 * 2.0 ** (random.integers(0, 48) / 12.0)
            fade = np.exp(-times_s * random.uniform(1.0, 8.0))
            for overtone in range(1, 6):
                if note_hz * overtone < RATE_HZ / 2:
                    wave = np.sin(2 * np.pi * note_hz * overtone * times_s)
                    total[start : start + length] += (fade * wave / overtone).astype(np.float32)
        if random.random() < 0.5:
            hit = random.standard_normal(RATE_HZ // 20, np.float32) * 2.0
            total[start : start + len(hit)] += hit * np.linspace(1, 0, len(hit), dtype=np.float32)
    return total


def _motors(count: int, random: np.random.Generator) -> Sound:
    """Return hums whose pitch wanders, as of drives and fans."""
    times_s = np.arange(count) / RATE_HZ
    total = 0.3 * random.standard_normal(count)
    for _ in range(4):
        base_hz = random.uniform(50, 900)
        wander = np.cumsum(np.sin(2 * np.pi * times_s * random.uniform(0.05, 0.5))) / RATE_HZ
        phase = 2 * np.pi * base_hz * (times_s + 0.1 * wander)
        total += sum(np.sin(n * phase) / n for n in range(1, 6))
    return total.astype(np.float32)


def _knocks(count: int, random: np.random.Generator) -> Sound:
    """Return what falls, clicks and rattles."""
    total = 0.02 * random.standard_normal(count, np.float32)
    for _ in range(BANK_S * 3):
        length = int(random.integers(RATE_HZ // 200, RATE_HZ // 5))
        start = int(random.integers(count - length))
        times_s = np.arange(length, dtype=np.float32) / RATE_HZ
        ring = np.sin(2 * np.pi * random.uniform(200, 5_000) * times_s)
        ring = ring + random.standard_normal(length, np.float32)
        total[start : start + length] += ring * np.exp(-times_s * random.uniform(20, 200))
    return total
