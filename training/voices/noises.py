"""Make noise of the kinds that a home and a robot have, each seeded and of unit power."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from training.voices.clip import RATE_HZ, Wave

Random = np.random.Generator


def noise(kind: str, count: int, random: Random) -> Wave:
    """Return that many samples of a kind of KINDS, with a mean power of one."""
    return unit_power(KINDS[kind](count, random))


def unit_power(samples: Wave) -> Wave:
    """Scale samples to a mean power of one; silence stays silence."""
    power = float(np.mean(np.square(samples, dtype=np.float64)))
    return samples if power == 0.0 else (samples / np.sqrt(power)).astype(np.float32)


def babble(talk: Sequence[Wave], count: int, random: Random) -> Wave:
    """Lay the talk of several people over each other, each from a place of its own."""
    mixed = np.zeros(count, np.float32)
    for samples in talk:
        if len(samples):
            turned = np.resize(np.roll(unit_power(samples), random.integers(len(samples))), count)
            mixed += turned * np.float32(random.uniform(0.4, 1.0))
    return unit_power(mixed)


def _shaped(count: int, random: Random, gain: Callable[[Wave], Wave]) -> Wave:
    """Return noise whose spectrum has that gain over frequency (Hz)."""
    spectrum = np.fft.rfft(random.standard_normal(count).astype(np.float32))
    hertz = np.fft.rfftfreq(count, 1 / RATE_HZ).astype(np.float32)
    return np.fft.irfft(spectrum * gain(hertz), count).astype(np.float32)


def _coloured(slope: float) -> Callable[[int, Random], Wave]:
    """Return noise whose power falls with that exponent of frequency."""
    return lambda count, random: _shaped(
        count, random, lambda hertz: (np.maximum(hertz, 30.0) ** (-slope / 2)).astype(np.float32)
    )


def _tones(count: int, hertz: float, harmonics: int, random: Random) -> Wave:
    times_s = np.arange(count, dtype=np.float32) / RATE_HZ
    total = np.zeros(count, np.float32)
    for number in range(1, harmonics + 1):
        if hertz * number < RATE_HZ / 2:
            phase = 2 * np.pi * (hertz * number * times_s + random.random())
            total += np.sin(phase) * np.float32(random.uniform(0.2, 1.0) / number)
    return total


def _hum(count: int, random: Random) -> Wave:
    mains_hz = float(random.choice([50.0, 60.0]))
    return _tones(count, mains_hz, 12, random) + 0.05 * random.standard_normal(count).astype(
        np.float32
    )


def _fan(count: int, random: Random) -> Wave:
    knee_hz = random.uniform(150.0, 1500.0)
    air = _shaped(count, random, lambda hertz: 1.0 / (1.0 + (hertz / knee_hz) ** 1.5))
    blades = _tones(count, float(random.uniform(60.0, 300.0)), 5, random)
    return unit_power(air) + np.float32(random.uniform(0.0, 0.6)) * unit_power(blades)


def _motor(count: int, random: Random) -> Wave:
    """Let gears whine up and down, as servos and wheels do."""
    times_s = np.arange(count, dtype=np.float32) / RATE_HZ
    centre_hz, swing, pace_hz = (
        random.uniform(200.0, 2500.0),
        random.uniform(0.05, 0.4),
        random.uniform(0.2, 2.0),
    )
    hertz = centre_hz * (1 + swing * np.sin(2 * np.pi * (pace_hz * times_s + random.random())))
    phase = 2 * np.pi * np.cumsum(hertz) / RATE_HZ
    whine = sum(np.float32(random.uniform(0.2, 1.0) / n) * np.sin(n * phase) for n in range(1, 5))
    rush = _coloured(0.7)(count, random)
    return unit_power(np.asarray(whine, np.float32)) + unit_power(rush) * np.float32(
        random.uniform(0.2, 1.0)
    )


def _clatter(count: int, random: Random) -> Wave:
    """Let dishes and doors clatter: short rings at odd moments over a quiet floor."""
    total = 0.02 * random.standard_normal(count).astype(np.float32)
    for _ in range(max(1, round(count / RATE_HZ * random.uniform(1.0, 5.0)))):
        length = int(random.uniform(0.02, 0.25) * RATE_HZ)
        start = int(random.integers(max(1, count - length)))
        decay = np.exp(-np.arange(length) / (length / 5)).astype(np.float32)
        ring = _tones(length, float(random.uniform(400.0, 4000.0)), 3, random)
        body = ring + random.standard_normal(length).astype(np.float32)
        piece = total[start : start + length]
        piece += (decay * body * np.float32(random.uniform(0.3, 1.5)))[: len(piece)]
    return total


def _music(count: int, random: Random) -> Wave:
    """Play chords of a few notes, each plucked or swelling."""
    total = np.zeros(count, np.float32)
    beat = int(random.uniform(0.2, 0.6) * RATE_HZ)
    for start in range(0, count, beat):
        length = min(beat * 2, count - start)
        rise = np.minimum(np.arange(length) / (0.01 * RATE_HZ), 1.0)
        envelope = (rise * np.exp(-np.arange(length) / (beat * random.uniform(0.3, 1.5)))).astype(
            np.float32
        )
        for _ in range(int(random.integers(1, 4))):
            hertz = 110.0 * 2.0 ** (random.integers(36) / 12)
            total[start : start + length] += envelope * _tones(length, hertz, 6, random)
    return total


KINDS: Final[Mapping[str, Callable[[int, Random], Wave]]] = {
    "white": _coloured(0.0),
    "pink": _coloured(1.0),
    "brown": _coloured(2.0),
    "hum": _hum,
    "fan": _fan,
    "motor": _motor,
    "clatter": _clatter,
    "music": _music,
}
