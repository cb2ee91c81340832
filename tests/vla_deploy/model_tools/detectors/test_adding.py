import dataclasses
import re

import numpy as np
import onnx
import pytest
from onnx import numpy_helper

from vla_deploy.inference.errors import (
    ImagesInvalid,
    ManifestInvalid,
    ModelFileSpoiled,
    ModelMismatch,
    ModelUnknown,
    RunFailed,
)
from vla_deploy.inference.manifest import Fit, TensorLayout, Variant
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.session import open_session
from vla_deploy.model_tools.detectors.adding import DetectorSource, add_model
from vla_deploy.perception.detectors.detector import Detector

NAMES = "{0: 'red', 1: 'green', 2: 'blue'}"


@pytest.fixture
def add(tmp_path, shelf, blobs):
    """Add the blob detector as a person would; `changes` replace what is told of it."""

    def add(graph=None, *, replace=False, **changes):
        file = tmp_path / "best.onnx"
        file.write_bytes((graph or blobs.raw()).SerializeToString())
        classes = tmp_path / "classes.txt"
        classes.write_text("red\ngreen\nblue\n")
        told = {
            "name": "mine",
            "onnx": file,
            "classes": classes,
            "adapter": None,
            "size_px": None,
            "summary": "blobs",
            "licence": "MIT",
            "card": None,
            "colour": "rgb",
            "fit": Fit.LETTERBOX,
            "fill": 114,
            "scale": 1 / 255,
            "mean": (0.0, 0.0, 0.0),
            "std": (1.0, 1.0, 1.0),
            "score_threshold": 0.25,
            "iou_threshold": 0.3,
        }
        source = DetectorSource(**{**told, **changes})
        return add_model(
            shelf.store, source, engines=shelf.engines, clock=shelf.clock, replace=replace
        )

    return add


def of_bytes(graph):
    """Make the input one of bytes, which the graph itself divides by 255."""
    (image,) = graph.graph.input
    head = [
        onnx.helper.make_node("Cast", ["bytes"], ["wide"], to=onnx.TensorProto.FLOAT),
        onnx.helper.make_node("Mul", ["wide", "share"], [image.name]),
    ]
    for place, node in enumerate(head):
        graph.graph.node.insert(place, node)
    graph.graph.initializer.append(numpy_helper.from_array(np.float32(1 / 255), "share"))
    image.name, image.type.tensor_type.elem_type = "bytes", onnx.TensorProto.UINT8
    return graph


def free(graph, *axes: int):
    """Make dimensions of the input free, as an export with dynamic axes has them."""
    for axis in axes:
        graph.graph.input[0].type.tensor_type.shape.dim[axis].dim_param = f"axis{axis}"
    return graph


def test_a_detector_is_added_as_it_describes_itself(add, shelf, blobs, tmp_path):
    card = tmp_path / "about.md"
    card.write_text("Trained on blobs.\n")
    model, trial = add(blobs.raw(names=NAMES), classes=None, card=card)
    assert model.manifest == shelf.store.load("mine").manifest
    detection = model.manifest.detection
    assert detection is not None
    assert (detection.adapter, detection.classes) == ("yolo", ("red", "green", "blue"))
    image = detection.image
    assert (image.width_px, image.height_px, image.layout) == (96, 64, TensorLayout.NCHW)
    assert set(model.manifest.files) == {Variant.FP32}
    assert (model.folder / model.manifest.card).read_text() == "Trained on blobs.\n"
    assert trial.boxes == {"black": 0, "white": 0, "grey": 0, "noise": 0}
    assert [path.name for path in shelf.store.user.iterdir()] == ["mine"]


def test_a_detector_that_sees_things_where_nothing_is_is_kept_and_said_so(add):
    _, trial = add(mean=(0.0, 0.9, 0.9))
    assert trial.boxes["white"] > 0
    assert str(trial).endswith("it sees things where nothing is: is the input as it was trained?")


def test_an_input_of_bytes_gets_pixels_as_they_are(add, blobs, shelf):
    model, _ = add(of_bytes(blobs.raw()), scale=None)
    assert (model.manifest.inputs[0].dtype, model.manifest.detection.image.scale) == ("uint8", 1.0)
    detector = Detector(open_session(model, PLAIN_CHOICE, engines=shelf.engines, clock=shelf.clock))
    rgb, things = blobs.photograph(0)
    assert sorted(detector.detect(rgb).classes) == sorted(number for number, *_ in things)
    detector.close()


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"scale": 1 / 255}, "detection.image.scale: got 0.00392"),
        ({"scale": 1.0, "mean": (0.5, 0.0, 0.0)}, "detection.image.mean: got [0.5, 0.0, 0.0]"),
        ({"scale": 1.0, "std": (2.0, 1.0, 1.0)}, "detection.image.std: got [2.0, 1.0, 1.0]"),
    ],
)
def test_an_input_of_bytes_takes_no_shares_of_255(add, blobs, shelf, changes, told):
    with pytest.raises(ManifestInvalid, match=re.escape(told)):
        add(of_bytes(blobs.raw()), **changes)
    assert shelf.store.names() == ()


@pytest.mark.parametrize("names", ["{0: 'red', 1: 'red', 2: 'blue'}", "{0: 'red', 1: '', 2: 'b'}"])
def test_an_export_with_names_that_are_none_is_not_added(add, blobs, shelf, names):
    with pytest.raises(ManifestInvalid, match=r"detection\.classes: got .*none twice"):
        add(blobs.raw(names=names), classes=None)
    assert shelf.store.names() == ()


def test_an_export_with_nms_in_the_graph_is_recognised(add, blobs):
    model, _ = add(blobs.end_to_end())
    assert model.manifest.detection is not None
    assert model.manifest.detection.adapter == "yolo_end_to_end"


def test_a_free_batch_is_settled_by_itself_and_a_free_size_by_the_person(add, blobs):
    model, _ = add(free(blobs.raw(), 0))
    assert model.manifest.inputs[0].shape == (1, 3, 64, 96)
    with pytest.raises(ModelMismatch, match=r"has no size; give one by --size WIDTHxHEIGHT"):
        add(free(blobs.raw(), 2, 3), name="other")
    model, _ = add(free(blobs.raw(), 2, 3), name="other", size_px=(96, 64))
    assert model.manifest.inputs[0].shape == (1, 3, 64, 96)


@pytest.mark.parametrize(
    ("changes", "error", "told"),
    [
        ({"adapter": "yolo_counted"}, ModelMismatch, "adapter yolo_counted: expected four outputs"),
        ({"name": "Mine!"}, ModelUnknown, "a model cannot be called 'Mine!'"),
        ({"classes": None}, ModelMismatch, "it names no classes; give them by --classes FILE"),
    ],
)
def test_what_does_not_fit_is_told_and_nothing_is_kept(add, shelf, changes, error, told):
    with pytest.raises(error, match=re.escape(told)):
        add(**changes)
    assert shelf.store.names() == ()
    assert not shelf.store.user.exists() or list(shelf.store.user.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("red\ngreen\n", "4 coordinates and 2 classes, got [1, 7, 96]; is the list of classes"),
        ("red\nred\nblue\n", "expected a name in each line, none twice"),
        ("", "expected a name in each line, none twice"),
    ],
)
def test_a_wrong_list_of_classes_is_told(add, tmp_path, text, told):
    file = tmp_path / "wrong.txt"
    file.write_text(text)
    with pytest.raises((ModelMismatch, ImagesInvalid), match=re.escape(told)):
        add(classes=file)


def test_the_files_own_names_win_over_a_list_in_another_order(add, blobs, tmp_path, shelf):
    file = tmp_path / "wrong.txt"
    file.write_text("green\nred\nblue\n")
    with pytest.raises(ModelMismatch, match="class 0: the file says 'red', the manifest 'green'"):
        add(blobs.raw(names=NAMES), classes=file)
    assert shelf.store.names() == ()


def test_a_file_that_is_no_graph_is_told(add, tmp_path):
    file = tmp_path / "cut.onnx"
    file.write_bytes(b"\x08\x09 not a graph")
    with pytest.raises(ModelFileSpoiled, match=r"cut\.onnx: onnxruntime 1\..* cannot load it"):
        add(onnx=file)
    with pytest.raises(ModelFileSpoiled, match=r"none\.onnx"):
        add(onnx=tmp_path / "none.onnx")


def test_a_graph_with_its_weights_in_another_file_is_told(add, blobs, tmp_path):
    onnx.save(
        blobs.raw(),
        str(tmp_path / "split.onnx"),
        save_as_external_data=True,
        location="split.data",
        size_threshold=0,
    )
    with pytest.raises(ModelFileSpoiled, match="expected one whole ONNX file; export it again"):
        add(onnx=tmp_path / "split.onnx")


def test_a_detector_that_tells_an_unknown_class_in_an_empty_image_is_not_kept(add, blobs, shelf):
    graph = blobs.end_to_end()
    weights = {one.name: one for one in graph.graph.initializer}
    loud = {
        "contrast": np.ones((3, 3, 1, 1), np.float32),
        "same": np.ones((3, 3, 1, 1), np.float32),
    }
    for name, value in loud.items():
        weights[name].CopyFrom(numpy_helper.from_array(value, name))
    cast = next(node for node in graph.graph.node if node.op_type == "Cast")
    shift = onnx.helper.make_node("Add", [cast.input[0], "seven"], ["shifted"], name="shift")
    graph.graph.node.insert([*graph.graph.node].index(cast), shift)
    graph.graph.initializer.append(numpy_helper.from_array(np.array([7]), "seven"))
    cast.input[0] = "shifted"
    with pytest.raises(RunFailed, match=r"told class \[7\], .* \(on an image that is black\)"):
        add(graph)
    assert list(shelf.store.user.iterdir()) == []


def test_a_taken_name_is_replaced_only_when_asked(add, shelf):
    add()
    with pytest.raises(ModelUnknown, match="there is a model 'mine' already; give --replace"):
        add(summary="again")
    add(summary="again", replace=True)
    assert shelf.store.load("mine").manifest.summary == "again"


def test_a_failed_replacement_leaves_the_old_one(add, shelf, blobs):
    add()
    before = dataclasses.asdict(shelf.store.load("mine").manifest)
    with pytest.raises(ModelMismatch):
        add(blobs.counted(), adapter="yolo", replace=True)
    assert dataclasses.asdict(shelf.store.load("mine").manifest) == before
