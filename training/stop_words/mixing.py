"""Lay clips one after another into long stretches of sound, with rooms, noise and what to learn."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from training.stop_words.corpus import Clips, Said
from training.stop_words.network import REACH
from training.stop_words.rooms import NoiseBank, in_a_room
from training.voices.clip import RATE_HZ
from vla_deploy.speech.stop_words.features import HOP, STRIDE, WINDOW, log_mel

Sound = NDArray[np.float32]
Labels = NDArray[np.int64]
IGNORED: Final = -1
FIRST_S: Final = 0.14
"""A word is to be told from so long after its end: by then it is no longer word."""
LAST_S: Final = 0.38
AFTER_S: Final = 0.7
STOP_SHARE: Final = 0.42
HARD_SHARE: Final = 0.35
MAX_HARD: Final = 600
WORD_SHARES: Final = (0.5, 0.25, 0.25)


@dataclass(slots=True, kw_only=True, eq=False)
class Stretch:
    """Hold one stretch: its frames, what each frame out is to say, and whose clip it is in.

    `others` gives the number of the clip of other talk at each frame out, -1 where there is none.
    """

    frames: NDArray[np.float32]
    labels: Labels
    others: NDArray[np.int64]


class Mixer:
    """Mix stretches by chance; clips that fooled the network come more often."""

    def __init__(self, stops: Clips, others: Clips, noise: NoiseBank, duration_s: float) -> None:
        self._stops = stops
        self._others = others
        self._noise = noise
        self._count = round(duration_s * RATE_HZ)
        self._by_word = _by_word(stops)
        self.hard: list[int] = []

    def remember(self, numbers: list[int]) -> None:
        """Take these clips of other talk more often from now on."""
        self.hard = [*self.hard, *numbers][-MAX_HARD:]

    def stretch(self, random: np.random.Generator) -> Stretch:
        """Return the next stretch."""
        sound = np.zeros(self._count, np.float32)
        events: list[tuple[int, float, float]] = []
        spans: list[tuple[int, int, int]] = []
        place = int(random.integers(RATE_HZ // 2))
        while place < self._count - RATE_HZ // 4:
            said, number = self._pick(random)
            values, ratio = _at_another_pace(said, random)
            end = min(self._count, place + len(values))
            sound[place:end] += values[: end - place]
            spans.append((place, end, number))
            start_s = place / RATE_HZ
            events += [
                (int(k), start_s + a * ratio, start_s + b * ratio) for k, a, b in said.events
            ]
            place = end + _gap(random)
        heard = self._heard(sound, random)
        return _labelled(heard, events, spans)

    def _pick(self, random: np.random.Generator) -> tuple[Said, int]:
        if random.random() < STOP_SHARE:
            with_word = self._by_word[int(random.choice(len(WORD_SHARES), p=WORD_SHARES))]
            return self._stops[int(with_word[random.integers(len(with_word))])], -1
        if self.hard and random.random() < HARD_SHARE:
            number = self.hard[int(random.integers(len(self.hard)))]
        else:
            number = int(random.integers(len(self._others)))
        return self._others[number], number

    def _heard(self, sound: Sound, random: np.random.Generator) -> Sound:
        heard = in_a_room(sound, random)
        power = float(np.mean(heard[heard != 0.0] ** 2)) + 1e-9
        if random.random() < 0.9:
            snr_db = random.uniform(5.0, 35.0)
            level = np.sqrt(power * 10.0 ** (-snr_db / 10.0))
            heard = heard + np.float32(level) * self._noise.take(self._count, random)
        loudness = 10.0 ** (random.uniform(-42.0, -8.0) / 20.0)
        heard = heard * np.float32(loudness / np.sqrt(power))
        hiss = 10.0 ** (random.uniform(-90.0, -62.0) / 20.0)
        heard = heard + np.float32(hiss) * random.standard_normal(self._count, np.float32)
        return np.clip(heard, -1.0, 1.0)


def varied(stretch: Stretch, random: np.random.Generator) -> Stretch:
    """Return a stretch as if it were louder or quieter, with a few bands missing."""
    frames = stretch.frames + np.float32(random.uniform(-0.3, 0.3))
    width, low = int(random.integers(0, 6)), int(random.integers(0, frames.shape[1] - 6))
    frames[:, low : low + width] = frames.mean()
    return Stretch(frames=frames, labels=stretch.labels, others=stretch.others)


def _by_word(stops: Clips) -> list[NDArray[np.int64]]:
    words = np.array([int(stops[k].events[0, 0]) for k in range(len(stops))])
    return [np.flatnonzero(words == k + 1) for k in range(len(WORD_SHARES))]


def _at_another_pace(said: Said, random: np.random.Generator) -> tuple[Sound, float]:
    """Return a clip at its own level, half of them with a longer or shorter throat."""
    values = said.samples.astype(np.float32)
    ratio = 1.0
    if random.random() < 0.5:
        count = round(len(values) * random.uniform(0.84, 1.2))
        ratio = count / len(values)
        places = np.linspace(0, len(values) - 1, count, dtype=np.float32)
        values = np.interp(places, np.arange(len(values)), values).astype(np.float32)
    level = np.sqrt(np.mean(values**2)) + 1.0
    return values * np.float32(10.0 ** (random.uniform(-5.0, 5.0) / 20.0) / level), ratio


def _gap(random: np.random.Generator) -> int:
    low_s, high_s = (0.0, 0.12) if random.random() < 0.3 else (0.12, 1.0)
    return int(random.uniform(low_s, high_s) * RATE_HZ)


def _labelled(
    sound: Sound, events: list[tuple[int, float, float]], spans: list[tuple[int, int, int]]
) -> Stretch:
    frames = log_mel(sound)
    count = (len(frames) - REACH) // STRIDE + 1
    newest = (np.arange(count) * STRIDE + REACH - 1) * HOP + WINDOW
    newest_s = newest / RATE_HZ
    labels = np.zeros(count, np.int64)
    for _, start_s, end_s in events:
        labels[(newest_s > start_s + 0.1) & (newest_s < end_s + AFTER_S)] = IGNORED
    for word, _, end_s in events:
        labels[(newest_s >= end_s + FIRST_S) & (newest_s <= end_s + LAST_S)] = word
    others = np.full(count, -1, np.int64)
    for start, end, number in spans:
        others[(newest >= start) & (newest < end + RATE_HZ // 5)] = number
    return Stretch(frames=frames, labels=labels, others=others)
