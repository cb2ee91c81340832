"""Lay clips one after another into long stretches of sound, with rooms, noise and what to learn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from training.stop_words.cast import SHARES
from training.stop_words.corpus import Clips, Said
from training.stop_words.network import REACH
from training.stop_words.picking import pick
from training.stop_words.rooms import NoiseBank, NoiseFrames, in_a_room
from training.voices.clip import RATE_HZ
from vla_deploy.speech.stop_words.features import (
    BAND_HZ,
    BANDS,
    HOP,
    SPREAD,
    STRIDE,
    WINDOW,
    log_mel,
)

Sound = NDArray[np.float32]
Labels = NDArray[np.int64]
_ByEngine = Mapping[str, NDArray[np.int64]]
IGNORED: Final = -1
FIRST_S: Final = 0.14
"""A word is to be told from so long after its end: by then it is no longer word."""
LAST_S: Final = 0.38
AFTER_S: Final = 0.7
STOP_SHARE: Final = 0.42
HARD_SHARE: Final = 0.2
MAX_HARD: Final = 1500
"""So many clips that fooled the network are remembered, each once. With a few hundred, each as
often as it fools, those that noise turns into a stop word crowd out all others."""
WORD_SHARES: Final = (0.5, 0.25, 0.25)
PHONE_AGO_S: Final = 0.1
"""A phone is told when what follows it can be heard too."""


@dataclass(slots=True, kw_only=True, eq=False)
class Stretch:
    """Hold one stretch: its frames, what each frame out is to say, and whose clip it is in.

    `others` gives the number of the clip of other talk at each frame out, -1 where there is none;
    `phones` the phone that sounded PHONE_AGO_S before, IGNORED where nobody knows.
    """

    frames: NDArray[np.float32]
    labels: Labels
    others: NDArray[np.int64]
    phones: Labels


@dataclass(slots=True, kw_only=True, eq=False)
class _Laid:
    """Note where a clip lies, in samples, and what it says when, in seconds of the stretch."""

    start: int
    end: int
    number: int
    events: list[tuple[int, float, float]]
    phones: NDArray[np.float32]


class Mixer:
    """Mix stretches by chance; clips that fooled the network come more often."""

    def __init__(self, stops: Clips, others: Clips, noise: NoiseBank, duration_s: float) -> None:
        self._stops = stops
        self._others = others
        self._noise = noise
        self._count = round(duration_s * RATE_HZ)
        self._by_word = _by_word(stops)
        self._by_engine = _by_engine(others.voices, np.ones(len(others), np.bool_))
        self.hard: list[int] = []

    def remember(self, numbers: list[int]) -> None:
        """Take these clips of other talk more often from now on."""
        self.hard = [*dict.fromkeys([*numbers, *self.hard])][:MAX_HARD]

    def stretch(self, random: np.random.Generator) -> Stretch:
        """Return the next stretch."""
        sound = np.zeros(self._count, np.float32)
        laid: list[_Laid] = []
        place = int(random.integers(RATE_HZ // 2))
        while place < self._count - RATE_HZ // 4:
            said, number = self._pick(random)
            values, ratio = _at_another_pace(said, random)
            end = min(self._count, place + len(values))
            sound[place:end] += values[: end - place]
            laid.append(_laid(said, place, end, number, ratio))
            place = end + _gap(random)
        return _labelled(self._heard(sound, random), laid)

    def _pick(self, random: np.random.Generator) -> tuple[Said, int]:
        if random.random() < STOP_SHARE:
            engines = self._by_word[int(random.choice(len(WORD_SHARES), p=WORD_SHARES))]
            return self._stops[_one_of(engines, random)], -1
        if self.hard and random.random() < HARD_SHARE:
            number = pick(self.hard, random)
        else:
            number = _one_of(self._by_engine, random)
        return self._others[number], number

    def _heard(self, sound: Sound, random: np.random.Generator) -> Sound:
        heard = in_a_room(sound, random)
        power = float(np.mean(heard[heard != 0.0] ** 2)) + 1e-9
        if random.random() < 0.9:
            snr_db = random.uniform(3.0, 33.0)
            level = np.sqrt(power * 10.0 ** (-snr_db / 10.0))
            heard = heard + np.float32(level) * self._noise.take(self._count, random)
        loudness = 10.0 ** (random.uniform(-42.0, -8.0) / 20.0)
        heard = heard * np.float32(loudness / np.sqrt(power))
        hiss = 10.0 ** (random.uniform(-90.0, -62.0) / 20.0)
        heard = heard + np.float32(hiss) * random.standard_normal(self._count, np.float32)
        return np.clip(heard, -1.0, 1.0)


def varied(stretch: Stretch, noise: NoiseFrames, random: np.random.Generator) -> Stretch:
    """Return a stretch as another speaker might say it elsewhere: no label changes.

    The throat is longer or shorter, it is louder or quieter, half of the time in one noise more,
    and a few bands and moments are missing.
    """
    frames = _of_another_throat(stretch.frames, random)
    if random.random() < 0.5:
        frames = _with_noise(frames, noise.take(len(frames), random), random.uniform(5.0, 30.0))
    frames += np.float32(random.uniform(-0.5, 0.5))
    mean = frames.mean()
    for most, line in ((6, frames.T), (6, frames.T), (5, frames), (5, frames), (5, frames)):
        width = int(random.integers(0, most + 1))
        start = int(random.integers(0, len(line) - most))
        line[start : start + width] = mean
    return replace(stretch, frames=frames)


def _of_another_throat(
    frames: NDArray[np.float32], random: np.random.Generator
) -> NDArray[np.float32]:
    """Return frames in which each band has what another one had, by a ratio of frequencies."""
    ratio = np.exp(random.uniform(-0.13, 0.13))
    places = np.interp(ratio * BAND_HZ, BAND_HZ, np.arange(BANDS))
    low = np.minimum(places.astype(np.int64), BANDS - 2)
    share = (places - low).astype(np.float32)
    moved: NDArray[np.float32] = frames[:, low] * (1.0 - share) + frames[:, low + 1] * share
    return moved


def _with_noise(
    frames: NDArray[np.float32], noise: NDArray[np.float32], snr_db: float
) -> NDArray[np.float32]:
    """Return the frames of two sounds at once, of mean powers at that ratio."""
    sound, other = SPREAD * frames, SPREAD * noise
    level = np.log(np.mean(np.exp(sound)) / np.mean(np.exp(other))) - snr_db * np.log(10.0) / 10.0
    both: NDArray[np.float32] = np.logaddexp(sound, other + np.float32(level)) / SPREAD
    return both


def _by_word(stops: Clips) -> list[_ByEngine]:
    words = np.array([int(stops[k].events[0, 0]) for k in range(len(stops))])
    return [_by_engine(stops.voices, words == k + 1) for k in range(len(WORD_SHARES))]


def _by_engine(voices: Sequence[str], wanted: NDArray[np.bool_]) -> _ByEngine:
    """Return the wanted clips of each engine."""
    engines = np.array([voice.partition("/")[0] for voice in voices])
    names = [str(name) for name in np.unique(engines[wanted])]
    return {name: np.flatnonzero(wanted & (engines == name)) for name in names}


def _one_of(engines: _ByEngine, random: np.random.Generator) -> int:
    """Return one clip: of each engine as often as its share says, however many it has."""
    shares = np.array([SHARES[name] for name in engines])
    clips = engines[str(random.choice(list(engines), p=shares / shares.sum()))]
    return int(clips[random.integers(len(clips))])


def _laid(said: Said, start: int, end: int, number: int, ratio: float) -> _Laid:
    start_s = start / RATE_HZ
    phones = said.phones * np.array((1.0, ratio), np.float32)
    return _Laid(
        start=start,
        end=end,
        number=number,
        events=[(int(k), start_s + a * ratio, start_s + b * ratio) for k, a, b in said.events],
        phones=phones + np.array((0.0, start_s), np.float32),
    )


def _at_another_pace(said: Said, random: np.random.Generator) -> tuple[Sound, float]:
    """Return a clip at its own level, most of them with a longer or shorter throat."""
    values = said.samples.astype(np.float32)
    ratio = 1.0
    if random.random() < 0.6:
        count = round(len(values) * random.uniform(0.8, 1.22))
        ratio = count / len(values)
        places = np.linspace(0, len(values) - 1, count, dtype=np.float32)
        values = np.interp(places, np.arange(len(values)), values).astype(np.float32)
    level = np.sqrt(np.mean(values**2)) + 1.0
    return values * np.float32(10.0 ** (random.uniform(-5.0, 5.0) / 20.0) / level), ratio


def _gap(random: np.random.Generator) -> int:
    low_s, high_s = (0.0, 0.12) if random.random() < 0.3 else (0.12, 1.0)
    return int(random.uniform(low_s, high_s) * RATE_HZ)


def _labelled(sound: Sound, laid: list[_Laid]) -> Stretch:
    frames = log_mel(sound)
    count = (len(frames) - REACH) // STRIDE + 1
    newest = (np.arange(count) * STRIDE + REACH - 1) * HOP + WINDOW
    newest_s = newest / RATE_HZ
    events = [event for one in laid for event in one.events]
    labels = np.zeros(count, np.int64)
    for _, start_s, end_s in events:
        labels[(newest_s > start_s + 0.1) & (newest_s < end_s + AFTER_S)] = IGNORED
    for word, _, end_s in events:
        labels[(newest_s >= end_s + FIRST_S) & (newest_s <= end_s + LAST_S)] = word
    others = np.full(count, -1, np.int64)
    for one in laid:
        others[(newest >= one.start) & (newest < one.end + RATE_HZ // 5)] = one.number
    return Stretch(
        frames=frames, labels=labels, others=others, phones=_phones(newest_s - PHONE_AGO_S, laid)
    )


def _phones(moments_s: NDArray[np.float64], laid: list[_Laid]) -> Labels:
    """Return the phone at each moment: silence between clips, IGNORED where the engine is mute."""
    told = np.zeros(len(moments_s), np.int64)
    for one in laid:
        inside = (moments_s >= one.start / RATE_HZ) & (moments_s < one.end / RATE_HZ)
        if not len(one.phones):
            told[inside] = IGNORED
            continue
        place = np.searchsorted(one.phones[:, 1], moments_s[inside], side="right") - 1
        told[inside] = np.where(place >= 0, one.phones[np.maximum(place, 0), 0], 0)
    return told
