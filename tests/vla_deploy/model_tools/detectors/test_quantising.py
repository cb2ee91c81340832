import dataclasses
import sys

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from vla_deploy.inference.errors import AccuracyLost, ImagesInvalid, ModelMismatch, PackageMissing
from vla_deploy.inference.manifest import Variant
from vla_deploy.model_tools.detectors.labelled import read_labelled, spread_paths
from vla_deploy.model_tools.detectors.quantising import head_nodes, quantise
from vla_deploy.model_tools.verifying import verify


@pytest.fixture
def quantised(shelf, photographs):
    """Quantise with six photographs; `changes` replace arguments."""

    def quantised(model, **changes):
        folder = photographs()
        arguments = {
            "name": model.manifest.name,
            "calibration": spread_paths(folder, 4),
            "labelled": read_labelled(folder, ("red", "green", "blue")),
            "max_drop_points": 1.0,
            "engines": shelf.engines,
            "clock": shelf.clock,
            **changes,
        }
        return quantise(shelf.store, model, **arguments)

    return quantised


def types_of(path) -> tuple[set[int], set[int]]:
    """Return the types that activations and convolutions' weights are quantised to."""
    graph = onnx.load(str(path)).graph
    held = {tensor.name: tensor for tensor in graph.initializer}
    activations = {
        held[node.input[2]].data_type
        for node in graph.node
        if node.op_type == "QuantizeLinear" and node.input[0] not in held
    }
    weights = {
        held[node.input[0]].data_type
        for node in graph.node
        if node.op_type == "DequantizeLinear"
        and node.input[0] in held
        and len(held[node.input[0]].dims) == 4
    }
    return activations, weights


def test_both_int8_files_are_installed_and_see_as_well(shelf, installed, quantised):
    done = quantised(installed())
    assert {variant: one.map50 for variant, one in done.accuracy.items()} == {
        Variant.FP32: 1.0,
        Variant.INT8_U8S8: 1.0,
        Variant.INT8_S8S8: 1.0,
    }
    assert (done.accuracy[Variant.FP32].things, done.drop_points) == (18, 0.0)
    measured = shelf.store.load("blobs").manifest.detection.measured
    assert (measured.precision, measured.recall, measured.things) == (1.0, 1.0, 18)
    findings = list(verify(shelf, "blobs"))
    assert [one.check for one in findings if one.is_ok] == [
        "manifest",
        *(f"{act} {variant}" for variant in done.accuracy for act in ("file", "run")),
    ]


def test_each_channel_of_the_weights_has_a_scale_of_its_own(shelf, installed, quantised):
    quantised(installed())
    model = shelf.store.load("blobs")
    for variant in (Variant.INT8_U8S8, Variant.INT8_S8S8):
        graph = onnx.load(str(model.folder / model.manifest.files[variant].path)).graph
        held = {tensor.name: tensor for tensor in graph.initializer}
        scales = [
            held[node.input[1]].dims
            for node in graph.node
            if node.op_type == "DequantizeLinear" and len(held_dims(held, node)) == 4
        ]
        assert scales == [[3], [3]]


def held_dims(held, node) -> list[int]:
    """Return the dimensions of the weights that a node reads, none where they are activations."""
    return held[node.input[0]].dims if node.input[0] in held else []


def test_activations_are_unsigned_for_cpus_and_signed_and_centred_for_tensorrt(
    shelf, installed, quantised
):
    quantised(installed())
    model = shelf.store.load("blobs")
    paths = {v: model.folder / file.path for v, file in model.manifest.files.items()}
    assert types_of(paths[Variant.INT8_U8S8]) == ({TensorProto.UINT8}, {TensorProto.INT8})
    assert types_of(paths[Variant.INT8_S8S8]) == ({TensorProto.INT8}, {TensorProto.INT8})
    zero_points = [
        numpy_helper.to_array(tensor)
        for tensor in onnx.load(str(paths[Variant.INT8_S8S8])).graph.initializer
        if tensor.name.endswith("_zero_point") and tensor.data_type == TensorProto.INT8
    ]
    assert zero_points
    assert not any(np.any(one) for one in zero_points)


def test_a_model_that_sees_worse_is_not_installed(shelf, installed, quantised, blobs):
    model = installed(blobs.raw(red_gain=3000.0))
    before = sorted(path.name for path in model.folder.iterdir())
    with pytest.raises(AccuracyLost) as caught:
        quantised(model, max_drop_points=5.0)
    assert "points, allowed are 5 (fp32 1.0000, int8_u8s8 0." in str(caught.value)
    assert sorted(path.name for path in model.folder.iterdir()) == before
    assert [path.name for path in shelf.store.user.iterdir()] == ["blobs"]
    assert set(shelf.store.load("blobs").manifest.files) == {Variant.FP32}


def test_a_drop_that_is_allowed_is_installed_and_told(shelf, installed, quantised, blobs):
    done = quantised(installed(blobs.raw(red_gain=3000.0)), max_drop_points=100.0, name="loud")
    assert done.drop_points > 30.0
    assert shelf.store.names() == ("blobs", "loud")
    assert Variant.INT8_U8S8 not in shelf.store.load("blobs").manifest.files


def test_without_the_packages_the_message_says_what_to_install(
    installed, quantised, monkeypatch, shelf
):
    model = installed()
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(
        PackageMissing, match=r"needs onnx, which is not installed; try: pip install"
    ):
        quantised(model)
    assert shelf.store.names() == ("blobs",)


def test_nothing_to_measure_with_is_told(installed, quantised):
    with pytest.raises(ImagesInvalid, match="expected images to calibrate and labelled ones"):
        quantised(installed(), labelled=[])


def test_only_detectors_with_an_original_are_quantised(installed, quantised):
    model = installed()
    manifest = dataclasses.replace(
        model.manifest, files={Variant.INT8_U8S8: model.manifest.files[Variant.FP32]}
    )
    with pytest.raises(ModelMismatch, match="expected a detector with an fp32 file"):
        quantised(dataclasses.replace(model, manifest=manifest))


def test_the_head_is_the_last_convolutions_and_what_follows():
    """Two branches as YOLO has them: one to scores, one through a distribution to boxes."""

    def conv(name: str, source: str, channels: int) -> onnx.NodeProto:
        weights.append(
            numpy_helper.from_array(np.ones((channels, 4, 1, 1), np.float32), f"{name}_w")
        )
        return helper.make_node("Conv", [source, f"{name}_w"], [name], name=name)

    weights: list[onnx.TensorProto] = []
    nodes = [
        conv("trunk", "image", 4),
        helper.make_node("Relu", ["trunk"], ["lit"], name="lit"),
        conv("score_last", "lit", 4),
        conv("box_last", "lit", 4),
        helper.make_node("Softmax", ["box_last"], ["shares"], name="softmax", axis=1),
        conv("read_out", "shares", 1),
        helper.make_node("Concat", ["score_last", "read_out"], ["out"], name="concat", axis=1),
    ]
    told = [helper.make_tensor_value_info("out", TensorProto.FLOAT, None)]
    image = [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 4, 8, 8])]
    graph = helper.make_graph(nodes, "yolo", image, told, weights)
    assert set(head_nodes(graph)) == {"score_last", "box_last", "softmax", "read_out", "concat"}


def test_the_head_stays_fp32_in_the_files(shelf, installed, quantised):
    quantised(installed())
    model = shelf.store.load("blobs")
    path = model.folder / model.manifest.files[Variant.INT8_U8S8].path
    graph = onnx.load(str(path)).graph
    makers = {output: node for node in graph.node for output in node.output}
    clip = next(node for node in graph.node if node.op_type == "Clip")
    assert makers[clip.input[0]].op_type == "Conv"
    quantised_convs = [
        node
        for node in graph.node
        if node.op_type == "Conv" and makers.get(node.input[1]) is not None
    ]
    assert len(quantised_convs) == 2
