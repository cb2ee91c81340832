from collections.abc import Sequence

import numpy as np
import pytest

pytest.importorskip("torch")

from training.stop_words.corpus import Said
from training.stop_words.mixing import IGNORED, MAX_HARD, PHONE_AGO_S, Mixer, Stretch, varied
from training.stop_words.network import REACH
from training.voices.clip import RATE_HZ
from training.voices.phones import NUMBERS
from vla_deploy.speech.stop_words.features import BANDS, HOP, STRIDE, WINDOW

CLIP_S = 1.0


class Clips(list[Said]):
    """Stand for the clips on disk."""

    @property
    def voices(self) -> Sequence[str]:
        """Return who speaks."""
        return [one.voice for one in self]


class Silence:
    """Add no noise."""

    def take(self, count: int, random: np.random.Generator) -> np.ndarray:
        """Return nothing to hear."""
        return np.zeros(count, np.float32)


class Hum:
    """Add frames of one tone."""

    def take(self, count: int, random: np.random.Generator) -> np.ndarray:
        """Return frames with one loud band."""
        loud = np.where(np.arange(BANDS) == 7, 0.5, -2.0).astype(np.float32)
        return np.tile(loud, (count, 1))


def said(engine: str, phones: list[tuple[str, float]], word: int = 0) -> Said:
    tone = 3000.0 * np.sin(np.arange(round(CLIP_S * RATE_HZ)) * 0.3)
    events = [(word, 0.2, 0.6)] if word else []
    rows = [(NUMBERS[phone], began_s) for phone, began_s in phones]
    return Said(
        samples=tone.astype(np.int16),
        voice=f"{engine}/one",
        events=np.array(events, np.float32).reshape(-1, 3),
        phones=np.array(rows, np.float32).reshape(-1, 2),
    )


def stretch(others: Clips, seed: int = 0) -> Stretch:
    stops = Clips(said("espeak", [("s", 0.0), ("aa", 0.4)], word) for word in (1, 2, 3))
    mixer = Mixer(stops, others, Silence(), 6.0)
    return mixer.stretch(np.random.default_rng(seed))


def test_a_phone_is_told_where_it_sounds_and_silence_between_clips() -> None:
    made = stretch(Clips([said("espeak", [("f", 0.0), ("iy", 0.5)])]))
    named = set(made.phones.tolist())
    assert named <= {NUMBERS[phone] for phone in ("pau", "s", "aa", "f", "iy")}
    inside = made.others == 0
    assert inside.any()
    newest_s = ((np.arange(len(inside)) * STRIDE + REACH - 1) * HOP + WINDOW) / RATE_HZ
    runs = np.flatnonzero(np.diff(inside.astype(int)) == 1) + 1
    for start in runs:
        began_s = newest_s[start]
        at = np.searchsorted(newest_s, began_s + PHONE_AGO_S + 0.1)
        if at < len(inside) and inside[at]:
            assert made.phones[at] == NUMBERS["f"]


def test_where_an_engine_tells_no_phones_none_is_learnt() -> None:
    made = stretch(Clips([said("pico", [])]))
    inside = made.others == 0
    assert inside.any()
    assert IGNORED in made.phones[inside]
    assert NUMBERS["f"] not in made.phones


def test_engines_with_few_clips_are_heard_as_often_as_those_with_many() -> None:
    many = [said("espeak", [("f", 0.0)]) for _ in range(60)]
    others = Clips([*many, said("flite", [("z", 0.0)])])
    heard = [
        int(n) for seed in range(40) for n in np.unique(stretch(others, seed).others) if n >= 0
    ]
    assert 0.3 < np.mean(np.array(heard) == 60) < 0.9


def test_a_stretch_that_is_varied_sounds_otherwise_and_says_the_same() -> None:
    made = stretch(Clips([said("espeak", [("f", 0.0)])]))
    before = made.frames.copy()
    some = [varied(made, Hum(), np.random.default_rng(seed)) for seed in range(8)]
    assert np.array_equal(made.frames, before), "the stretch itself is shown again"
    for one in some:
        assert one.frames.shape == before.shape
        assert one.frames.dtype == np.float32
        assert np.isfinite(one.frames).all()
        assert not np.allclose(one.frames, before)
        assert one.labels is made.labels
    assert len({float(one.frames.mean()) for one in some}) == len(some)


def test_a_clip_that_fools_often_is_remembered_once_and_the_oldest_forgotten() -> None:
    one = Clips([said("espeak", [("f", 0.0)], word) for word in (1, 2, 3)])
    mixer = Mixer(one, one, Silence(), 6.0)
    mixer.remember([4, 4, 5])
    mixer.remember([5, 6])
    assert mixer.hard == [5, 6, 4]
    mixer.remember(list(range(100, 100 + MAX_HARD)))
    assert len(mixer.hard) == MAX_HARD
    assert 4 not in mixer.hard
