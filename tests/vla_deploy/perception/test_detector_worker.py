"""Asking a real network beside the steps: in time, late, failing, replaced, not to be opened."""

import dataclasses
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore
from vla_deploy.perception.images.detector_worker import (
    FAILURES_TO_DISMISS,
    DetectorAnswer,
    DetectorWorker,
    load_detector,
)


class HeldBack(Executor):
    """Run what was handed in when told to, in order."""

    def __init__(self) -> None:
        self._waiting: deque[Callable[[], None]] = deque()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()

        def run() -> None:
            try:
                future.set_result(fn(*args, **kwargs))
            except Exception as error:
                future.set_exception(error)

        self._waiting.append(run)
        return future

    def catch_up(self) -> None:
        while self._waiting:
            self._waiting.popleft()()


class Clock:
    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("eyes never wait")


@pytest.fixture
def rgb():
    image = np.full((64, 96, 3), 90, dtype=np.uint8)
    image[16:32, 16:32] = (255, 0, 0)
    return image


@pytest.fixture
def shelf(tmp_path):
    return ModelShelf(
        store=ModelStore(tmp_path / "models", tmp_path / "none"),
        engines=tmp_path / "engines",
        clock=MonotonicClock(),
    )


@pytest.fixture
def model(tmp_path, lay_out, blob_manifest, blobs):
    content = blobs.raw().SerializeToString()
    return lay_out(tmp_path / "models", blob_manifest, {Variant.INT8_U8S8: content})


def profile(*, required: bool = False):
    desktop = load_profile("desktop")
    choice = dataclasses.replace(desktop.models["detector"], tiers=("blobs",), required=required)
    return dataclasses.replace(desktop, models=MappingProxyType({"detector": choice}))


@pytest.fixture
def executor():
    return HeldBack()


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def worker(executor, clock, shelf, model):
    made = DetectorWorker(executor, clock)
    made.replace(load_detector(shelf, profile(), 0))
    return made


def test_an_answer_is_awaited_and_then_taken_once(worker, executor, rgb):
    worker.ask(rgb)
    assert worker.answer() is None
    executor.catch_up()
    answer = worker.answer()
    assert [one.class_name for one in answer.view.reliabilities] == ["red", "green", "blue"]
    assert {int(one) for one in answer.view.boxes.classes} == {0}
    assert worker.answer() == DetectorAnswer(view=None)
    assert worker.document()["model"]["runs"] == 1


def test_things_are_named_by_form_until_a_slow_detector_answers(worker, executor, clock, rgb):
    worker.ask(rgb)
    clock.ns = 1_100_000_000
    assert worker.answer() == DetectorAnswer(view=None)
    assert worker.document()["mode"] == "form"
    assert worker.document()["why"] == "no answer within 1 s"
    worker.ask(rgb)  # it is still busy with the first
    assert worker.answer() == DetectorAnswer(view=None)
    executor.catch_up()
    worker.ask(rgb)
    executor.catch_up()
    assert worker.answer().view is not None
    assert (worker.document()["mode"], worker.document()["late"]) == ("network", 1)


def test_a_network_that_fails_again_and_again_is_asked_no_more(worker, executor, rgb, caplog):
    worker.loaded.detector.close()
    for number in range(FAILURES_TO_DISMISS):
        assert worker.loaded.detector is not None
        worker.ask(rgb)
        executor.catch_up()
        assert worker.answer() == DetectorAnswer(view=None)
        assert worker.document()["mode"] == "form"
        assert "session is closed" in worker.document()["why"]
        assert ("asked no more" in caplog.text) is (number + 1 == FAILURES_TO_DISMISS)
    assert worker.document()["model"] is None
    worker.ask(rgb)
    assert worker.answer() == DetectorAnswer(view=None)


def test_a_network_that_is_replaced_still_answers_what_it_was_asked(worker, executor, shelf, rgb):
    worker.ask(rgb)
    worker.release(worker.replace(load_detector(shelf, profile(), 0)))
    executor.catch_up()
    assert worker.answer().view is not None
    worker.ask(rgb)
    executor.catch_up()
    assert worker.answer().view is not None


def cut_off(folder, blobs):
    path = folder / "int8_u8s8.onnx"
    path.write_bytes(path.read_bytes()[:200])
    return "it was cut off or replaced"


def without_manifest(folder, blobs):
    (folder / "model.toml").unlink()
    return "no model 'blobs'"


def other_classes(folder, blobs):
    text = (folder / "model.toml").read_text()
    spoiled = text.replace('"red", "green", "blue"', '"red", "green"')
    assert spoiled != text
    (folder / "model.toml").write_text(spoiled)
    return "is the list of classes right"


def other_shape(folder, blobs):
    text = (folder / "model.toml").read_text()
    spoiled = text.replace("[1, 7, 96]", "[1, 7, 84]")
    assert spoiled != text
    (folder / "model.toml").write_text(spoiled)
    return "expected shape [1, 7, 84]"


SPOILERS = (cut_off, without_manifest, other_classes, other_shape)


@pytest.mark.parametrize("spoil", SPOILERS)
def test_a_model_that_is_no_good_leaves_the_robot_without_one_and_says_why(
    shelf, model, blobs, spoil
):
    told = spoil(model, blobs)
    network = load_detector(shelf, profile(), 0)
    assert network.detector is None
    assert told in network.why
    for changes in ({"required": True}, {}):
        with pytest.raises(InferenceError):
            load_detector(shelf, profile(**changes), 0, replaces_one=not changes)


def test_weights_that_give_no_numbers_are_refused_when_the_model_is_opened(
    tmp_path, shelf, lay_out, blob_manifest, blobs
):
    content = blobs.raw(red_gain=float("nan")).SerializeToString()
    lay_out(tmp_path / "models", blob_manifest, {Variant.INT8_U8S8: content})
    network = load_detector(shelf, profile(), 0)
    assert network.detector is None
    assert "values are no numbers" in network.why


def test_a_profile_that_names_no_detector_goes_by_form(shelf):
    bare = dataclasses.replace(load_profile("desktop"), models={})
    network = load_detector(shelf, bare, 0)
    assert (network.detector, network.why) == (None, "profile desktop names no detector")


def fails_on_bright_images() -> bytes:
    """Return a model whose logarithm has a number for black and none for anything bright."""
    image = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, 64, 96])
    output = helper.make_tensor_value_info("output", TensorProto.FLOAT, [1, 7, 96])
    constants = {
        "axes": np.array([1, 2, 3]),
        "little": np.array([0.1], np.float32),
        "table": np.zeros((1, 7, 96), np.float32),
    }
    nodes = [
        helper.make_node("ReduceMean", ["images", "axes"], ["mean"], keepdims=0),
        helper.make_node("Sub", ["little", "mean"], ["room"]),
        helper.make_node("Log", ["room"], ["shift"]),
        helper.make_node("Add", ["table", "shift"], ["output"]),
    ]
    tensors = [numpy_helper.from_array(value, name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "bright", [image], [output], tensors)
    opset = [helper.make_opsetid("", 18)]
    content: bytes = helper.make_model(graph, opset_imports=opset, ir_version=8).SerializeToString()
    return content


def test_weights_that_give_no_numbers_for_an_image_fail_that_image(
    tmp_path, shelf, lay_out, blob_manifest, executor, clock, rgb
):
    lay_out(tmp_path / "models", blob_manifest, {Variant.INT8_U8S8: fails_on_bright_images()})
    worker = DetectorWorker(executor, clock)
    worker.replace(load_detector(shelf, profile(), 0))
    worker.ask(rgb)
    executor.catch_up()
    assert worker.answer() == DetectorAnswer(view=None)
    assert (
        "blobs: output 'output': 672 of its 672 values are no numbers" in worker.document()["why"]
    )
