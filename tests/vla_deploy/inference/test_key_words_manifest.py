"""A spotter's manifest says how its scores are read, and every fault of it is told."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from vla_deploy.inference.errors import ManifestInvalid
from vla_deploy.inference.manifest import SpottingMeasured
from vla_deploy.inference.manifest_file import read_manifest, write_manifest

WRITTEN = """
name = "mine"
role = "key_words"
summary = "hears stop"
licence = "MIT"

[[inputs]]
name = "frames"
shape = [1, 40, 151]
dtype = "float32"

[[outputs]]
name = "scores"
shape = [1, 3, 2]
dtype = "float32"

[files.fp32]
path = "mine.onnx"
sha256 = "0000000000000000000000000000000000000000000000000000000000000000"

[key_words]
features = "log_mel_40"
words = ["stop", "halt"]
smoothing_frames = 3
refractory_s = 1.0

[key_words.thresholds]
low = 0.9
normal = 0.8
high = 0.5
"""


@pytest.fixture
def folder(tmp_path: Path) -> Callable[[str], Path]:
    def written(text: str) -> Path:
        path = tmp_path / "mine"
        path.mkdir()
        (path / "model.toml").write_text(text)
        return path

    return written


def test_it_is_read_and_written_as_the_same(folder: Callable[[str], Path]) -> None:
    path = folder(WRITTEN)
    read = read_manifest(path)
    assert read.key_words is not None
    assert read.key_words.thresholds["high"] == 0.5
    measured = SpottingMeasured(missed_ratio=0.01, false_alarms_per_hour=0.5, delay_p95_s=0.3)
    full = dataclasses.replace(
        read, key_words=dataclasses.replace(read.key_words, measured=measured)
    )
    write_manifest(path, full)
    assert read_manifest(path) == full


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (("smoothing_frames = 3", "smoothing_frames = 0"), "key_words.smoothing_frames: got 0, "),
        (('["stop", "halt"]', '["Stop", "halt"]'), "key_words.words: got ['Stop', 'halt'], "),
        (("high = 0.5", "high = 1.5"), "key_words.thresholds.high: got 1.5, expected a number "),
        (("shape = [1, 3, 2]", "shape = [1, 2, 2]"), "outputs: got shapes [[1, 2, 2]], expected"),
        ((WRITTEN[WRITTEN.index("[key_words]") :], ""), "key_words: got nothing, expected a tab"),
    ],
)
def test_each_fault_is_told(
    folder: Callable[[str], Path], change: tuple[str, str], fault: str
) -> None:
    with pytest.raises(ManifestInvalid) as caught:
        read_manifest(folder(WRITTEN.replace(*change)))
    assert len(caught.value.faults) == 1
    assert caught.value.faults[0].startswith(fault)
