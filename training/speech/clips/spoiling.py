"""Spoil clean speech as rooms, machines and microphones do, each time another way."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from training.voices.clip import RATE_HZ, Wave
from training.voices.mixing import at_level, at_snr
from training.voices.noises import KINDS, babble, noise, unit_power
from training.voices.rooms import draw_room, in_room

Random = np.random.Generator
_PIECE_S: Final = 12
_PIECES_PER_KIND: Final = 6
_BABBLE_SHARE: Final = 0.15
_ROOMS: Final = 200


class Spoiler:
    """Hold noises and rooms to draw from."""

    def __init__(self, talk: Sequence[Wave], random: Random) -> None:
        count = _PIECE_S * RATE_HZ
        self._pieces = [
            noise(kind, count, random) for kind in KINDS for _ in range(_PIECES_PER_KIND)
        ]
        self._babble = [
            babble([talk[int(n)] for n in random.integers(len(talk), size=16)], count, random)
            for _ in range(_PIECES_PER_KIND)
        ]
        self._rooms = [draw_room(random) for _ in range(_ROOMS)]

    def spoil(self, speech: Wave, lead_s: float, tail_s: float, random: Random) -> Wave:
        """Return speech spoilt, `lead_s` after the start and `tail_s` before the end."""
        wave = np.pad(speech, (int(lead_s * RATE_HZ), int(tail_s * RATE_HZ)))
        if random.random() < 0.35:
            wave = in_room(wave, self._rooms[int(random.integers(_ROOMS))])
        if random.random() < 0.8:
            wave = at_snr(wave, self.noise(len(wave), random), float(_draw_snr_db(random)))
        wave = at_level(wave, float(random.uniform(-42.0, -8.0)))
        if random.random() < 0.05:
            wave = np.clip(wave * np.float32(random.uniform(2.0, 8.0)), -0.5, 0.5)
        hiss = random.standard_normal(len(wave)).astype(np.float32)
        return wave + hiss * np.float32(10.0 ** random.uniform(-5.0, -3.3))

    def noise(self, count: int, random: Random) -> Wave:
        """Return noise of one or two kinds."""
        made = self._one(count, random)
        if random.random() < 0.25:
            made = made + np.float32(random.uniform(0.2, 1.0)) * self._one(count, random)
        return unit_power(made)

    def _one(self, count: int, random: Random) -> Wave:
        pieces = self._babble if random.random() < _BABBLE_SHARE else self._pieces
        piece = pieces[int(random.integers(len(pieces)))]
        start = int(random.integers(len(piece)))
        return np.resize(np.roll(piece, -start)[:count], count)


def _draw_snr_db(random: Random) -> float:
    return float(np.clip(random.normal(14.0, 9.0), -2.0, 40.0))


def draw_gains(clips: int, mels: int, random: Random) -> Wave:
    """Return gains over frequency (clip, mel), in powers of ten: tilt, waves, at times a cut."""
    places = np.linspace(0.0, 1.0, mels)
    gains = random.normal(0.0, 0.4, (clips, 1)) * (places - 0.5)
    for number in range(1, 5):
        size = random.normal(0.0, 0.25 / number, (clips, 1))
        gains = gains + size * np.cos(np.pi * (number * places + random.random((clips, 1))))
    for row in np.flatnonzero(random.random(clips) < 0.12):
        gains[row, places > random.uniform(0.6, 0.95)] -= random.uniform(1.0, 5.0)
    for row in np.flatnonzero(random.random(clips) < 0.08):
        gains[row, places < random.uniform(0.03, 0.15)] -= random.uniform(0.5, 3.0)
    return gains.astype(np.float32)
