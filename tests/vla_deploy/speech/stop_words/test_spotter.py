"""A word counts when its mean score reaches the threshold, once, and at the time it was settled."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.inference.errors import ModelMismatch
from vla_deploy.inference.manifest import Manifest
from vla_deploy.speech.sound import RATE_HZ, Sound, duration_ns
from vla_deploy.speech.stop_words.spotter import Spotted, Spotter

THRESHOLD = 0.7


def quiet(duration_s: float) -> Sound:
    return np.zeros(round(duration_s * RATE_HZ), np.float32)


def loud(duration_s: float) -> Sound:
    return np.random.default_rng(0).normal(0.0, 0.3, round(duration_s * RATE_HZ)).astype(np.float32)


def fed(
    spotter: Spotter, sound: Sound, threshold: float = THRESHOLD, piece: int = 512
) -> list[Spotted]:
    found = []
    for at in range(0, len(sound), piece):
        part = sound[at : at + piece]
        spotted = spotter.feed(part, duration_ns(at + len(part)), threshold)
        found += [] if spotted is None else [spotted]
    return found


def test_a_word_is_told_once_with_its_score_and_time(spotter: Spotter) -> None:
    sound = np.concatenate([quiet(0.5), loud(0.3), quiet(0.5)])
    (spotted,) = fed(spotter, sound)
    assert spotted.word == "stop"
    assert spotted.score == pytest.approx(0.96)
    assert 0.5 * NS_PER_S < spotted.stamp_ns < 0.65 * NS_PER_S


@pytest.mark.parametrize("piece", [160, 512, 3_000, RATE_HZ * 2])
def test_the_size_of_the_pieces_changes_neither_word_nor_time(spotter: Spotter, piece: int) -> None:
    sound = np.concatenate([quiet(0.5), loud(0.3), quiet(0.5)])
    expected = fed(spotter, sound, piece=320)
    spotter.reset()
    (spotted,) = fed(spotter, sound, piece=piece)
    assert spotted == expected[0]


def test_a_moment_alone_does_not_reach_the_threshold(spotter: Spotter) -> None:
    click = np.concatenate([quiet(0.5), loud(0.01), quiet(0.5)])
    assert fed(spotter, click) == []


def test_the_threshold_decides(spotter: Spotter) -> None:
    sound = np.concatenate([quiet(0.5), loud(0.3)])
    assert fed(spotter, sound, threshold=0.97) == []


def test_a_word_that_lasts_is_told_again_only_after_the_refractory_time(spotter: Spotter) -> None:
    first, second = fed(spotter, np.concatenate([quiet(0.2), loud(1.6)]))
    assert second.stamp_ns - first.stamp_ns >= NS_PER_S


def test_after_a_reset_nothing_of_before_counts(spotter: Spotter) -> None:
    fed(spotter, np.concatenate([quiet(0.5), loud(0.03)]), threshold=0.99)
    spotter.reset()
    assert fed(spotter, quiet(0.5)) == []


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"key_words": None}, "got no .key_words"),
        ({"inputs": ()}, "one input of shape"),
    ],
)
def test_a_model_of_another_kind_is_refused(
    scorer: Any, manifest: Manifest, change: dict[str, Any], told: str
) -> None:
    with pytest.raises(ModelMismatch, match=told):
        Spotter(scorer, dataclasses.replace(manifest, **change))
