"""The ear for stop words tells them from frames alone, and a spoiled file of one is told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper, save

from vla_deploy.inference.errors import ModelFileSpoiled, RunFailed
from vla_deploy.inference.manifest import ModelFile
from vla_deploy.inference.store import Model
from vla_deploy.speech.stop_ear import FILE, FRAMES, SCORES, StopEar, open_stop_ear

CLASSES = 4


def write_graph(path: Path, given: str = FRAMES, rank: int = 3) -> None:
    """Write a graph that says of each frame what stands in it, a class in each band."""
    shape: list[Any] = [1, CLASSES, "frame"][:rank]
    turned = [0, 2, 1] if rank == 3 else [1, 0]
    graph = helper.make_graph(
        [helper.make_node("Transpose", [given], [SCORES], perm=turned)],
        "ear",
        [helper.make_tensor_value_info(given, TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info(SCORES, TensorProto.FLOAT, [None] * rank)],
    )
    save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)


def model(folder: Path, *parts: str) -> Model:
    files = tuple(ModelFile(path=name, sha256="0" * 64) for name in parts)
    manifest: Any = type("Manifest", (), {"parts": files})()
    return Model(manifest=manifest, folder=folder, is_embedded=False)


@pytest.fixture
def ear(tmp_path: Path) -> StopEar:
    write_graph(tmp_path / FILE)
    opened = open_stop_ear(model(tmp_path, "model.bin", FILE))
    assert opened is not None
    return opened


def frames(*high: int, count: int = 30) -> np.ndarray:
    """Return frames of no word, but for those in which the second word is certain."""
    made = np.zeros((CLASSES, count), np.float32)
    made[0] = 1.0
    made[:, list(high)] = np.array([[0.0], [0.0], [1.0], [0.0]])
    return made


def test_a_word_is_told_by_scores_in_a_row_and_one_alone_may_be_chance(ear: StopEar) -> None:
    assert ear.surety(frames(12, 13)) == 1.0
    assert ear.surety(frames(12)) == 0.5
    assert ear.surety(frames()) == 0.0


@pytest.mark.parametrize("count", [0, 1])
def test_next_to_no_sound_holds_no_word(ear: StopEar, count: int) -> None:
    assert ear.surety(frames(count=count)) == 0.0


def test_frames_of_other_bands_are_refused(ear: StopEar) -> None:
    with pytest.raises(RunFailed, match=FILE):
        ear.surety(np.zeros((CLASSES + 1, 20), np.float32))


def test_a_closed_ear_hears_nothing(ear: StopEar) -> None:
    ear.close()
    with pytest.raises(RunFailed, match="closed"):
        ear.surety(frames(1))


def test_a_recogniser_without_an_ear_has_none(tmp_path: Path) -> None:
    assert open_stop_ear(model(tmp_path, "model.bin")) is None


def _cut_off(path: Path) -> None:
    write_graph(path)
    path.write_bytes(path.read_bytes()[:-20])


@pytest.mark.parametrize(
    "spoil",
    [
        _cut_off,
        lambda path: path.write_text("no ear"),
        lambda path: write_graph(path, given="sound"),
        lambda path: write_graph(path, rank=2),
    ],
)
def test_a_spoiled_ear_is_told(tmp_path: Path, spoil: Any) -> None:
    spoil(tmp_path / FILE)
    with pytest.raises(ModelFileSpoiled, match=FILE):
        open_stop_ear(model(tmp_path, FILE))


def test_a_word_that_was_said_before_a_phrase_is_not_in_it(ear: StopEar) -> None:
    assert ear.surety(frames(12, 13), from_s=0.48) == 1.0
    assert ear.surety(frames(12, 13), from_s=0.56) == 0.0
    assert ear.surety(frames(12, 13), from_s=9.0) == 0.0


class Listening:
    """Give frames of a word for so many sounds, then of none; note how long each sound is."""

    def __init__(self, words: int) -> None:
        self.heard: list[int] = []
        self._words = words

    def frames_of(self, sound: np.ndarray) -> np.ndarray:
        self.heard.append(len(sound))
        return frames(12, 13) if len(self.heard) <= self._words else frames()


NOTHING, SECOND = np.zeros(0, np.float32), np.zeros(16_000, np.float32)


def test_a_phrase_that_may_hold_a_word_is_heard_again_and_the_mean_tells(ear: StopEar) -> None:
    assert ear.surety_of(SECOND, NOTHING, Listening(0).frames_of) == 0.0
    listening = Listening(3)
    assert ear.surety_of(SECOND, NOTHING, listening.frames_of) == pytest.approx(3 / 4)
    assert listening.heard[:2] == [16_000, 16_480]
    assert [round(16_000 / count, 2) for count in listening.heard[2:]] == [0.91, 1.09]


def test_it_is_heard_with_what_was_before_where_no_word_counts(ear: StopEar) -> None:
    listening = Listening(7)
    assert ear.surety_of(SECOND, SECOND[:800], listening.frames_of) == 1.0
    assert listening.heard[:2] == [16_800, 17_280]
    assert ear.surety_of(SECOND, SECOND[:9_600], Listening(7).frames_of) == 0.0


@pytest.mark.parametrize(("seconds", "heard_s"), [(26.8, 27.0), (29.0, 27.0)])
def test_of_a_phrase_that_is_too_long_the_end_is_heard(
    ear: StopEar, seconds: float, heard_s: float
) -> None:
    listening = Listening(0)
    sound = np.zeros(round(16_000 * seconds), np.float32)
    assert ear.surety_of(sound, SECOND[:9_600], listening.frames_of) == 0.0
    assert listening.heard == [16_000 * heard_s]
