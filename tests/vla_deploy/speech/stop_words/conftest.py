from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.manifest import KeyWords, Manifest, ModelFile, Tensor, Variant
from vla_deploy.speech.stop_words.spotter import Spotter

FRAMES, MOMENTS = 20, 2
MANIFEST = Manifest(
    name="stop_words",
    role="key_words",
    summary="hears two words",
    licence="Apache-2.0",
    card="",
    inputs=(Tensor(name="frames", shape=(1, 40, FRAMES), dtype="float32"),),
    outputs=(Tensor(name="scores", shape=(1, 3, MOMENTS), dtype="float32"),),
    files={Variant.FP32: ModelFile(path="stop_words.onnx", sha256="0" * 64)},
    key_words=KeyWords(
        features="log_mel_40",
        words=("stop", "halt"),
        smoothing_frames=3,
        refractory_s=1.0,
        thresholds={"low": 0.97, "normal": 0.7, "high": 0.5},
    ),
)


class LoudnessScorer:
    """Be a model for which every loud moment is the first word: what it hears is in its input."""

    def __init__(self) -> None:
        self.runs = 0
        self.is_broken = False
        self.word = 0

    def run(self, inputs: Mapping[str, NDArray[Any]]) -> Mapping[str, NDArray[Any]]:
        if self.is_broken:
            raise RunFailed("stop_words: out of memory")
        self.runs += 1
        newest = inputs["frames"][0, :, -2 * MOMENTS :].max(axis=0)
        loud = newest.reshape(MOMENTS, 2).max(axis=1)
        scores = np.zeros((1, 3, MOMENTS), np.float32)
        scores[0, 1 + self.word] = np.where(loud > 0.5, 0.96, 0.05)
        scores[0, 0] = 1.0 - scores[0, 1 + self.word]
        return {"scores": scores}


@pytest.fixture
def scorer() -> LoudnessScorer:
    return LoudnessScorer()


@pytest.fixture
def manifest() -> Manifest:
    return MANIFEST


@pytest.fixture
def spotter(scorer: Any) -> Spotter:
    return Spotter(scorer, MANIFEST)
