"""Compare training's frames with those of faster-whisper; needs torch, as training does."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")
faster_whisper = pytest.importorskip("faster_whisper")

from training.speech.clips.features import HOP, frames  # noqa: E402


def test_frames_are_those_that_faster_whisper_makes() -> None:
    random = np.random.default_rng(0)
    waves = [random.standard_normal(count).astype(np.float32) * 0.1 for count in (16_000, 9_600)]
    stacked = torch.zeros(2, 16_000)
    for row, wave in enumerate(waves):
        stacked[row, : len(wave)] = torch.from_numpy(wave)
    made = frames(stacked, torch.tensor([16_000, 9_600])).numpy()
    extractor = faster_whisper.feature_extractor.FeatureExtractor(hop_length=HOP)
    for row, wave in enumerate(waves):
        expected = extractor(wave)
        # At a shorter clip's end faster-whisper mirrors, a batch has zeros: the last frame differs.
        inside = expected.shape[1] - 1
        assert made[row, :, :inside] == pytest.approx(expected[:, :inside], abs=2e-3)
        assert not made[row, :, expected.shape[1] :].any()
