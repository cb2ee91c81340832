import dataclasses

import pytest

from vla_deploy.inference.errors import ManifestInvalid
from vla_deploy.inference.manifest import ClassMeasured, Measured, ModelFile, Tensor, Variant
from vla_deploy.inference.manifest_file import read_manifest, write_manifest

WRITTEN = """
name = "mine"
role = "detector"
summary = "what it sees"
licence = "MIT"

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
sha256 = "0000000000000000000000000000000000000000000000000000000000000000"

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


@pytest.fixture
def faults_of(tmp_path):
    def faults_of(text: str, folder: str = "mine") -> tuple[str, ...]:
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "model.toml").write_text(text)
        with pytest.raises(ManifestInvalid) as caught:
            read_manifest(tmp_path / folder)
        assert str(caught.value).startswith(str(tmp_path / folder / "model.toml"))
        return caught.value.faults

    return faults_of


def test_a_manifest_that_a_person_wrote_is_read(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "model.toml").write_text(WRITTEN)
    manifest = read_manifest(tmp_path / "mine")
    assert manifest.outputs == (Tensor(name="output0", shape=(1, 6, "boxes"), dtype="float32"),)
    assert manifest.detection is not None
    assert manifest.detection.classes == ("cup", "ball")
    assert manifest.detection.image.std == (1, 1, 1)
    assert manifest.card == ""


def test_what_is_written_is_read_as_the_same(tmp_path, blob_manifest):
    files = {variant: ModelFile(path=f"{variant}.onnx", sha256="ab" * 32) for variant in Variant}
    full = dataclasses.replace(
        blob_manifest, files=files, card="card.md", summary='sagt "Käse" \\ und\nnoch mehr'
    )
    plain = dataclasses.replace(full, role="planner", detection=None, card="")
    for manifest in (full, plain):
        folder = tmp_path / manifest.role / "blobs"
        folder.mkdir(parents=True)
        write_manifest(folder, manifest)
        assert read_manifest(folder) == manifest


def test_every_fault_is_told_at_once(faults_of):
    text = (
        WRITTEN.replace('role = "detector"', 'role = "cook"\ncolour = 3')
        .replace('"float32"\n\n[files', '"float128"\n\n[files')
        .replace("mine.onnx", "../mine.onnx")
        .replace('"0000', '"zz')
        .replace('["cup", "ball"]', '["cup", "cup"]')
        .replace("iou_threshold = 0.45", "iou_threshold = 45")
        .replace("std = [1, 1, 1]", "std = [1, 0, 1]")
        .replace("fill = 114\n", "")
    )
    expected = (
        "colour: got an unknown key, expected one of name, role, ",
        "role: got 'cook', expected one of detector, planner, ",
        "outputs[0].dtype: got 'float128', expected one of float32, ",
        "files.fp32.path: got '../mine.onnx', expected a file in the model's folder",
        "files.fp32.sha256: got 'zz00",
        "detection.classes: got ['cup', 'cup'], expected a list of names, none twice",
        "detection.iou_threshold: got 45, expected a number from 0 to 1",
        "detection.image.fill: got nothing, expected an integer in 0..255",
        "detection.image.std: got [1, 0, 1], expected three numbers above 0",
    )
    faults = faults_of(text)
    assert len(faults) == len(expected)
    for fault, beginning in zip(faults, expected, strict=True):
        assert fault.startswith(beginning)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (("480, 640]", "640, 480]"), "inputs: got shapes [[1, 3, 640, 480]], expected one of shap"),
        (('layout = "nchw"', 'layout = "nhwc"'), "inputs: got shapes [[1, 3, 480, 640]], expected"),
        (('name = "mine"', 'name = "ours"'), "name: got 'ours', expected 'mine', as its folder"),
        (("[files.fp32]", "[files.fp64]"), "files.fp64: got an unknown key, expected one of fp32"),
        (("[[outputs]]", "[[inputs]]"), "outputs: got nothing, expected a list of tables"),
        (
            ("[detection.image]", "weak_score_threshold = 0.3\n[detection.image]"),
            "detection.weak_score_threshold: got 0.3, expected at most score_threshold, 0.25",
        ),
    ],
)
def test_what_does_not_fit_together_is_told(faults_of, change, fault):
    assert faults_of(WRITTEN.replace(*change, 1))[0].startswith(fault)


@pytest.mark.parametrize(("line", "least"), [("", 0.25), ("weak_score_threshold = 0.1\n", 0.1)])
def test_weak_boxes_are_read_where_the_manifest_says_so(tmp_path, line, least):
    text = WRITTEN.replace("[detection.image]", f"{line}[detection.image]")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "model.toml").write_text(text)
    manifest = read_manifest(tmp_path / "mine")
    assert manifest.detection is not None
    assert manifest.detection.least_score == least
    write_manifest(tmp_path / "mine", manifest)
    assert read_manifest(tmp_path / "mine") == manifest


def test_a_detector_needs_to_say_how_it_is_read(faults_of):
    (fault,) = faults_of(WRITTEN[: WRITTEN.index("[detection]")])
    assert fault == "detection: got nothing, expected a table, as the role is detector"


@pytest.mark.parametrize("text", ["name = ", "name = 'mine'\x00", "\udcff"])
def test_what_is_no_toml_is_told(tmp_path, text):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "model.toml").write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(ManifestInvalid, match="expected a TOML document"):
        read_manifest(tmp_path / "mine")


def test_what_a_detector_was_measured_at_is_read_and_written_again(tmp_path):
    measured = WRITTEN + "\n[detection.measured]\nprecision = 0.8\nrecall = 0.7\n"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "model.toml").write_text(measured)
    manifest = read_manifest(tmp_path / "mine")
    assert manifest.detection is not None
    assert manifest.detection.measured == Measured(precision=0.8, recall=0.7)
    write_manifest(tmp_path / "mine", manifest)
    assert read_manifest(tmp_path / "mine") == manifest


def test_a_measurement_that_no_detector_can_have_is_a_fault(faults_of):
    faults = faults_of(WRITTEN + "\n[detection.measured]\nprecision = 80\n")
    assert any("detection.measured.precision" in fault and "0 to 1" in fault for fault in faults)
    assert any("detection.measured.recall" in fault for fault in faults)


def test_figures_by_class_are_written_and_read_again(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "model.toml").write_text(WRITTEN)
    manifest = read_manifest(tmp_path / "mine")
    cup = ClassMeasured(name="cup", precision=0.8, recall=0.7, boxes=40, things=45)
    measured = Measured(precision=0.8, recall=0.7, boxes=40, things=45, classes=(cup,))
    detection = dataclasses.replace(manifest.detection, measured=measured)
    write_manifest(tmp_path / "mine", dataclasses.replace(manifest, detection=detection))
    assert read_manifest(tmp_path / "mine").detection.measured == measured


@pytest.mark.parametrize(
    ("row", "told"),
    [
        (
            'name = "bowl"\nboxes = 1',
            "detection.measured.classes: got ['bowl'], expected each once",
        ),
        (
            'name = "cup"\nboxes = -1',
            "detection.measured.classes[0].boxes: got -1, expected an inte",
        ),
        (
            'name = "cup"\nboxes = true',
            "detection.measured.classes[0].boxes: got True, expected an",
        ),
    ],
)
def test_figures_of_classes_that_cannot_be_are_faults(faults_of, row, told):
    (fault,) = faults_of(
        f"{WRITTEN}\n[detection.measured]\nprecision = 0.8\nrecall = 0.7\n"
        f"[[detection.measured.classes]]\nprecision = 0.8\nrecall = 0.7\nthings = 0\n{row}\n"
    )
    assert fault.startswith(told)
