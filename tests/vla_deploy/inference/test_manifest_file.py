"""A manifest is read and written as the same, and every fault of it is reported."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from vla_deploy.inference.errors import ManifestInvalid
from vla_deploy.inference.manifest import ClassMeasured, Manifest, Measured, Tensor
from vla_deploy.inference.manifest_file import read_manifest, write_manifest

_SHA256: Final = "00" * 32
HEAD: Final = """
name = "mine"
role = "{role}"
summary = "what it is for"
licence = "MIT"
"""
DETECTOR: Final = f"""{HEAD.format(role="detector")}
[[inputs]]
name = "images"
shape = [1, 3, 480, 640]
dtype = "float32"

[[outputs]]
name = "output0"
shape = [1, 6, "boxes"]
dtype = "float32"

[files.fp32]
path = "mine.onnx"
sha256 = "{_SHA256}"

[detection]
adapter = "yolo"
classes = ["cup", "ball"]
score_threshold = 0.25
iou_threshold = 0.45

[detection.image]
width_px = 640
height_px = 480
layout = "nchw"
colour = "rgb"
fit = "letterbox"
fill = 114
scale = 0.00392156862745098
mean = [0, 0, 0]
std = [1, 1, 1]
"""
WEAK: Final = DETECTOR.replace("iou_t", "weak_score_threshold = 0.1\niou_t")
MEASURED: Final = f"{DETECTOR}\n[detection.measured]\nprecision = 0.8\nrecall = 0.7\n"
BY_CLASS: Final = f"""{MEASURED}boxes = 40
things = 45
[[detection.measured.classes]]
name = "cup"
precision = 0.8
recall = 0.7
boxes = 39
things = 45
"""
SPOTTER: Final = f"""{HEAD.format(role="key_words")}
[[inputs]]
name = "frames"
shape = [1, 40, 151]
dtype = "float32"

[[outputs]]
name = "scores"
shape = [1, 3, 2]
dtype = "float32"

[files.fp16]
path = "mine.onnx"
sha256 = "{_SHA256}"

[files.int8_u8s8]
path = "mine_int8.onnx"
sha256 = "{_SHA256}"

[key_words]
features = "log_mel_40"
words = ["stop", "halt"]
smoothing_frames = 3
refractory_s = 1.0

[key_words.measured]
missed_ratio = 0.01
false_alarms_per_hour = 0.5
delay_p95_s = 0.3

[key_words.thresholds]
low = 0.9
normal = 0.8
high = 0.5
"""
PLAIN: Final = SPOTTER[: SPOTTER.index("[key_words]")].replace('"key_words"', '"planner"')


def _parts(*paths: str) -> str:
    return "".join(f'[[parts]]\npath = "{path}"\nsha256 = "{_SHA256}"\n' for path in paths)


WHISPER: Final = f"""{HEAD.format(role="speech_to_text")}card = "card.md"
{_parts("model.bin", "config.json", "vocabulary.json", "tokenizer.json")}
[whisper]
languages = ["en"]
context = "trimmed"

[whisper.calibration]
bias = 3
log_probability = 4.5
no_speech = -3
compression = -2
"""
LANGUAGE: Final = f"""{HEAD.format(role="planner")}
{_parts("model.onnx", "genai_config.json", "tokenizer.json")}
[language]
use = "command_parser"
most_tokens = 160

[language.certainty]
bias = 2.2
least = 3.4
mean = 3.2
strange = -0.1
read_back_below = 0.88
decline_below = 0.25
"""


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], Manifest]:
    def read(text: str) -> Manifest:
        (tmp_path / "mine").mkdir(exist_ok=True)
        (tmp_path / "mine" / "model.toml").write_bytes(text.encode(errors="surrogateescape"))
        return read_manifest(tmp_path / "mine")

    return read


@pytest.fixture
def faults_of(read: Callable[[str], Manifest], tmp_path: Path) -> Callable[[str], tuple[str, ...]]:
    def faults_of(text: str) -> tuple[str, ...]:
        with pytest.raises(ManifestInvalid) as caught:
            read(text)
        assert str(caught.value).startswith(str(tmp_path / "mine" / "model.toml"))
        return caught.value.faults

    return faults_of


def test_a_manifest_that_a_person_wrote_is_read(read):
    manifest = read(DETECTOR)
    assert manifest.outputs == (Tensor(name="output0", shape=(1, 6, "boxes"), dtype="float32"),)
    assert manifest.detection.classes == ("cup", "ball")
    assert manifest.detection.image.std == (1, 1, 1)
    assert (manifest.card, manifest.detection.least_score) == ("", 0.25)
    assert read(WEAK).detection.least_score == 0.1
    cup = ClassMeasured(name="cup", precision=0.8, recall=0.7, boxes=39, things=45)
    for text, expected in (
        (MEASURED, Measured(precision=0.8, recall=0.7)),
        (BY_CLASS, Measured(precision=0.8, recall=0.7, boxes=40, things=45, classes=(cup,))),
    ):
        assert read(text).detection.measured == expected
    # A key of earlier releases, without a meaning now.
    assert read(WHISPER.replace("[whisper]\n", "[whisper]\nhot_words = true\n")) == read(WHISPER)


@pytest.mark.parametrize("text", [DETECTOR, WEAK, BY_CLASS, SPOTTER, PLAIN, WHISPER, LANGUAGE])
def test_what_is_written_is_read_as_the_same(read, tmp_path, text):
    manifest = dataclasses.replace(read(text), summary='sagt "Käse" \\ und noch mehr')
    write_manifest(tmp_path / "mine", manifest)
    assert read_manifest(tmp_path / "mine") == manifest


@pytest.mark.parametrize(
    ("text", "changes", "expected"),
    [
        (
            DETECTOR,
            {
                'role = "detector"': 'role = "cook"\ncolour = 3',
                '"float32"\n\n[files': '"float128"\n\n[files',
                "mine.onnx": "../mine.onnx",
                '"0000': '"zz',
                '["cup", "ball"]': '["cup", "cup"]',
                "iou_threshold = 0.45": "iou_threshold = 45",
                "std = [1, 1, 1]": "std = [1, 0, 1]",
                "fill = 114\n": "",
            },
            (
                "colour: got an unknown key, expected one of name, role, ",
                "role: got 'cook', expected one of detector, planner, ",
                "outputs[0].dtype: got 'float128', expected one of float32, ",
                "files.fp32.path: got '../mine.onnx', expected a file in the model's folder",
                "files.fp32.sha256: got 'zz00",
                "detection.classes: got ['cup', 'cup'], expected a list of names, none twice",
                "detection.iou_threshold: got 45, expected a number in 0..1",
                "detection.image.fill: got nothing, expected an integer in 0..255",
                "detection.image.std: got [1, 0, 1], expected three numbers above 0",
            ),
        ),
        (
            MEASURED,
            {"precision = 0.8": "precision = 80", "recall = 0.7": ""},
            (
                "detection.measured.recall: got nothing, expected a number in 0..1",
                "detection.measured.precision: got 80, expected a number in 0..1",
            ),
        ),
        (
            WHISPER,
            {'["en"]': '["EN"]', "trimmed": "short", "bias": "bios"},
            (
                "whisper.languages: got ['EN'], expected a list of language codes",
                "whisper.context: got 'short', expected one of padded, trimmed",
                "whisper.calibration.bias: got nothing",
                "whisper.calibration.bios: got an unknown key",
            ),
        ),
        (
            LANGUAGE,
            {"most_tokens = 160": "most_tokens = 0", "mean = 3.2\n": ""},
            (
                "language.most_tokens: got 0, expected an integer of 1 or more",
                "language.certainty.mean: got nothing, expected a number",
            ),
        ),
    ],
)
def test_every_fault_is_reported_at_once(faults_of, text, changes, expected):
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    faults = faults_of(text)
    assert len(faults) == len(expected)
    for fault, beginning in zip(faults, expected, strict=True):
        assert fault.startswith(beginning)


_CLASS: Final = "detection.measured.classes"


@pytest.mark.parametrize(
    ("text", "old", "new", "fault"),
    [
        (DETECTOR, "480, 640]", "640, 480]", "inputs: got shapes [[1, 3, 640, 480]], expected one"),
        (DETECTOR, '"nchw"', '"nhwc"', "inputs: got shapes [[1, 3, 480, 640]], expected"),
        (DETECTOR, 'name = "mine"', 'name = "ours"', "name: got 'ours', expected 'mine', as its"),
        (DETECTOR, "[files.fp32]", "[files.fp64]", "files.fp64: got an unknown key, expected one"),
        (DETECTOR, "[[outputs]]", "[[inputs]]", "outputs: got nothing, expected a list of tables"),
        (
            DETECTOR,
            DETECTOR[DETECTOR.index("[detection]") :],
            "",
            "detection: got nothing, expected a table, as the role is detector",
        ),
        (
            WEAK,
            "threshold = 0.1",
            "threshold = 0.3",
            "detection.weak_score_threshold: got 0.3, expected at most score_threshold, 0.25",
        ),
        (BY_CLASS, 'name = "cup"', 'name = "bowl"', f"{_CLASS}: got ['bowl'], expected each once"),
        (BY_CLASS, "boxes = 39", "boxes = -1", f"{_CLASS}[0].boxes: got -1, expected an i"),
        (BY_CLASS, "boxes = 39", "boxes = true", f"{_CLASS}[0].boxes: got True, expected an"),
        (SPOTTER, "smoothing_frames = 3", "smoothing_frames = 0", "key_words.smoothing_frames: "),
        (SPOTTER, '["stop", ', '["Stop", ', "key_words.words: got ['Stop', 'halt'], "),
        (SPOTTER, "high = 0.5", "high = 1.5", "key_words.thresholds.high: got 1.5, expected a num"),
        (SPOTTER, "[1, 3, 2]", "[1, 2, 2]", "outputs: got shapes [[1, 2, 2]], expected one of sha"),
        (SPOTTER, SPOTTER[SPOTTER.index("[key_words]") :], "", "key_words: got nothing, expected"),
        (WHISPER, '"speech_to_text"', '"detector"', "role: got detector, expected speech_to_text"),
        *(
            (WHISPER, f'"{path}"', '"else"', f"expected {path} among them")
            for path in ("model.bin", "config.json", "vocabulary.json", "tokenizer.json")
        ),
        (LANGUAGE, "model.onnx", "model.bin", "expected an .onnx file among them"),
    ],
)
def test_what_does_not_fit_together_is_reported(faults_of, text, old, new, fault):
    assert old in text
    assert fault in faults_of(text.replace(old, new, 1))[0]


@pytest.mark.parametrize("text", ["name = ", "name = 'mine'\x00", "\udcff"])
def test_what_is_no_toml_is_reported(read, text):
    with pytest.raises(ManifestInvalid, match="expected a TOML document"):
        read(text)
