"""Train for a moment on noise that stands for speech; needs torch."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from training.speech.sizes import SIZES  # noqa: E402
from training.speech.training import BEFORE_FALL, WEIGHTS, train  # noqa: E402
from training.voices.clip import Sound, SpokenClip  # noqa: E402
from training.voices.clip_store import write_shard  # noqa: E402


def _clips() -> list[SpokenClip]:
    random = np.random.default_rng(0)
    return [
        SpokenClip(
            text=text,
            engine="none",
            voice="noise",
            samples=(0.1 * random.standard_normal(8_000 + 400 * number)).astype(np.float32),
            sounds=(Sound(phone="pau", began_s=0.0), Sound(phone="k", began_s=0.2)),
        )
        for number, text in enumerate(("red cup", "go home", "turn left", "stop") * 3)
    ]


def test_a_training_ends_in_time_keeps_what_was_before_its_fall_and_goes_on(
    tmp_path: Path,
) -> None:
    write_shard(tmp_path / "clips" / "0000", _clips())
    size = replace(SIZES["smoke"], text_tokens=280)
    train(tmp_path, size, 2.0)
    first = torch.load(tmp_path / WEIGHTS, weights_only=True)
    before = torch.load(tmp_path / BEFORE_FALL, weights_only=True)
    assert all(bool(torch.isfinite(value).all()) for value in first.values())
    assert 0.0 < before["spent_s"] < 2.0
    train(tmp_path, size, before["spent_s"] + 0.6)
    again = torch.load(tmp_path / WEIGHTS, weights_only=True)
    assert any(not torch.equal(first[name], again[name]) for name in first)


def test_a_training_without_clips_says_how_to_make_them(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="make them by the step data"):
        train(tmp_path, SIZES["smoke"], 1.0)
