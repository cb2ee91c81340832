"""The head for stop words tells them from states alone, and a spoiled file of one is told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.manifest import ModelFile
from vla_deploy.inference.store import Model
from vla_deploy.speech.stop_head import FILE, StopHead, open_stop_head

WIDTH, CHANNELS, WORDS = 3, 2, 3


def weights() -> dict[str, Any]:
    """Return a head for which the second word is where the first channel of a state is high."""
    near, far = np.zeros((CHANNELS, WIDTH, 3)), np.zeros((CHANNELS, CHANNELS, 5))
    near[0, 0, 1] = far[0, 0, 2] = 1.0
    last = np.zeros((1 + WORDS, CHANNELS))
    last[2, 0] = 10.0
    biases = {"near.bias": np.zeros(2), "far.bias": np.zeros(2), "last.bias": [5.0, 0, 0, 0]}
    tensors = {"near.weight": near, "far.weight": far, "last.weight": last, **biases}
    return {name: np.asarray(values, np.float32) for name, values in tensors.items()}


def states(*high: int) -> np.ndarray:
    made = np.zeros((30, WIDTH), np.float32)
    made[list(high), 0] = 1.0
    return made


def test_a_word_is_told_by_states_in_a_row_and_one_alone_may_be_chance() -> None:
    head = StopHead(weights())
    assert head.surety(states(12, 13)) > 0.95
    assert 0.4 < head.surety(states(12)) < 0.6
    assert head.surety(states()) < 0.05


@pytest.mark.parametrize("count", [0, 1])
def test_next_to_no_sound_holds_no_word(count: int) -> None:
    assert StopHead(weights()).surety(np.ones((count, WIDTH), np.float32)) == 0.0


def test_a_convolution_looks_both_ways_as_far_as_it_reaches() -> None:
    made = weights()
    made["near.weight"][0, 0, :] = 0.0
    made["near.weight"][0, 0, 2] = 1.0
    earlier = StopHead(made)
    assert earlier.surety(states(0)) < 0.05, "nothing is before the first state"
    assert earlier.surety(states(1, 2)) > 0.95


def model(folder: Path, *parts: str) -> Model:
    files = tuple(ModelFile(path=name, sha256="0" * 64) for name in parts)
    manifest: Any = type("Manifest", (), {"parts": files})()
    return Model(manifest=manifest, folder=folder, is_embedded=False)


def test_a_recogniser_without_a_head_has_none(tmp_path: Path) -> None:
    assert open_stop_head(model(tmp_path, "model.bin")) is None


def test_a_head_is_read_from_its_file(tmp_path: Path) -> None:
    np.savez(tmp_path / FILE, **weights())
    head = open_stop_head(model(tmp_path, "model.bin", FILE))
    assert head is not None
    assert head.surety(states(3, 4)) > 0.95


def _cut_off(path: Path) -> None:
    np.savez(path, **weights())
    path.write_bytes(path.read_bytes()[:-400])


def _other_shapes(path: Path) -> None:
    np.savez(path, **{**weights(), "far.weight": np.zeros((2, 7, 5), np.float32)})


def _lacking(path: Path) -> None:
    np.savez(path, **{"near.weight": np.zeros((2, 3, 3), np.float32)})


@pytest.mark.parametrize(
    "spoil", [_cut_off, _other_shapes, _lacking, lambda path: path.write_text("no head")]
)
def test_a_spoiled_head_is_told(tmp_path: Path, spoil: Any) -> None:
    spoil(tmp_path / FILE)
    with pytest.raises(ModelFileSpoiled, match=r"no head for stop words: .*training\.stop_head"):
        open_stop_head(model(tmp_path, FILE))
