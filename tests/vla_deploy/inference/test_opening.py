import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from onnx import TensorProto, helper

from drivers.clock import MonotonicClock
from vla_deploy.inference import opening
from vla_deploy.inference.errors import (
    ModelFileSpoiled,
    ModelMismatch,
    ProviderUnavailable,
    RunFailed,
)
from vla_deploy.inference.manifest import Tensor, Variant
from vla_deploy.inference.opening import open_graph, session_options
from vla_deploy.inference.runtime import available_providers
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import ModelStore

CPU, CUDA, AZURE = "CPUExecutionProvider", "CUDAExecutionProvider", "AzureExecutionProvider"
TENSORRT = "TensorrtExecutionProvider"


@pytest.fixture
def put(tmp_path, lay_out, blob_manifest, blobs):
    """Lay out a blob detector whose manifest or content differs; return it as a model."""

    def put(contents=None, **changes):
        whole = blobs.raw().SerializeToString()
        manifest = dataclasses.replace(blob_manifest, **changes)
        lay_out(tmp_path, manifest, contents or {Variant.FP32: whole})
        return ModelStore(tmp_path, tmp_path / "none").load("blobs")

    return put


@pytest.fixture
def opened(tmp_path, cpu_choice):
    def opened(model, available=None, **changes):
        return open_session(
            model,
            cpu_choice(**changes),
            engines=tmp_path / "engines",
            clock=MonotonicClock(),
            available=available,
        )

    return opened


@pytest.mark.parametrize(
    ("precision", "variant"), [("fp32", Variant.FP32), ("int8", Variant.INT8_U8S8)]
)
def test_a_cpu_gets_the_file_that_is_fast_there(put, opened, blobs, precision, variant):
    whole = blobs.raw().SerializeToString()
    model = put(dict.fromkeys(Variant, whole))
    session = opened(model, precision=precision)
    assert (session.variant, session.provider, session.notices) == (variant, CPU, ())


def test_a_model_without_that_file_runs_with_its_original_and_says_so(put, opened):
    session = opened(put(), precision="int8")
    assert session.variant == Variant.FP32
    assert session.notices == (f"blobs has no int8_u8s8 file: fp32 runs on {CPU}",)


def test_a_provider_that_this_onnxruntime_lacks_is_an_error(put, opened):
    with pytest.raises(ProviderUnavailable) as caught:
        opened(put(), providers=(TENSORRT, CUDA), precision="int8")
    text = str(caught.value)
    assert text.startswith(f"blobs: no provider runs it: {TENSORRT}: this onnxruntime 1.")
    assert f"{CUDA}: this onnxruntime 1." in text
    assert text.endswith("or set cpu_fallback in the profile")


def test_a_profile_may_allow_the_cpu_and_is_told(put, opened):
    session = opened(put(), providers=(CUDA,), cpu_fallback=True)
    assert session.provider == CPU
    (notice,) = session.notices
    assert notice.startswith(f"{CUDA}: this onnxruntime 1.")


# A library that claims CUDA and has none: what onnxruntime then does is the real thing.
@pytest.mark.filterwarnings("ignore:Specified provider 'CUDAExecutionProvider':UserWarning")
def test_a_silent_fall_back_to_the_cpu_is_an_error(put, opened):
    model = put()
    with pytest.raises(ProviderUnavailable, match=f"{CUDA}: onnxruntime silently took {CPU} inst"):
        opened(model, available=(CUDA, CPU), providers=(CUDA,))
    session = opened(model, available=(CUDA, CPU), providers=(CUDA,), cpu_fallback=True)
    assert session.notices == (f"{CUDA}: onnxruntime silently took {CPU} instead",)


@pytest.mark.skipif(AZURE not in available_providers(), reason="this build has no idle provider")
def test_a_provider_that_is_listed_and_computes_nothing_is_an_error(put, opened):
    with pytest.raises(ProviderUnavailable, match="it is listed but computes none of the 7 nodes"):
        opened(put(), providers=(AZURE,))


def test_a_changed_file_is_refused(put, opened):
    model = put()
    file = model.folder / "fp32.onnx"
    file.write_bytes(file.read_bytes()[:-100])
    with pytest.raises(ModelFileSpoiled, match=r"expected SHA-256 \w{64}, got \w{64} over \d+ byt"):
        opened(model)
    file.unlink()
    with pytest.raises(ModelFileSpoiled, match="No such file"):
        opened(model)


@pytest.mark.parametrize("kept", [0, 40, 0.5, 0.99])
def test_a_cut_off_graph_is_refused_even_when_it_was_checked_in_so(put, opened, blobs, kept):
    whole = blobs.raw().SerializeToString()
    part = whole[: kept if isinstance(kept, int) else int(kept * len(whole))]
    model = put({Variant.FP32: part})
    with pytest.raises((ModelFileSpoiled, ModelMismatch)) as caught:
        opened(model)
    assert str(model.folder) in str(caught.value)


def test_every_difference_between_graph_and_manifest_is_told(put, opened):
    model = put(
        inputs=(Tensor(name="images", shape=(1, 3, "height", 128), dtype="uint8"),),
        outputs=(
            Tensor(name="boxes", shape=(1, 7, 96), dtype="float32"),
            Tensor(name="output", shape=(1, 84, 96), dtype="float32"),
        ),
        detection=None,
        role="planner",
    )
    with pytest.raises(ModelMismatch) as caught:
        opened(model)
    assert caught.value.faults == (
        "input 'images': expected uint8, the graph has float32",
        "input 'images': expected shape [1, 3, 'height', 128], the graph has [1, 3, 64, 96]",
        "output 'boxes': expected by the manifest, the graph has ['output']",
        "output 'output': expected shape [1, 84, 96], the graph has [1, 7, 96]",
    )


@pytest.mark.parametrize(
    ("names", "fault"),
    [
        ("{0: 'red', 1: 'blue', 2: 'green'}", "class 1: the file says 'blue', the manifest 'gre"),
        ("{0: 'red', 1: 'green'}", "classes: the file names 2, the manifest 3"),
        ("['red', 'green', 'navy']", "class 2: the file says 'navy', the manifest 'blue'"),
    ],
)
def test_classes_that_the_file_names_otherwise_are_told(put, opened, blobs, names, fault):
    model = put({Variant.FP32: blobs.raw(names=names).SerializeToString()})
    with pytest.raises(ModelMismatch) as caught:
        opened(model)
    assert fault in str(caught.value)


@pytest.mark.parametrize("names", ["{0: 'red', 1: 'green', 2: 'blue'}", "made by me", ""])
def test_a_file_that_names_the_same_classes_or_none_is_taken(put, opened, blobs, names):
    assert opened(put({Variant.FP32: blobs.raw(names=names).SerializeToString()})).provider == CPU


@pytest.mark.parametrize("arena", [True, False])
def test_threads_and_memory_are_as_the_profile_says(cpu_choice, arena):
    options = session_options(cpu_choice(threads=3, memory_arena=arena))
    assert (options.intra_op_num_threads, options.inter_op_num_threads) == (3, 1)
    assert (options.enable_cpu_mem_arena, options.enable_mem_pattern) == (arena, arena)


@given(st.data())
def test_a_spoiled_graph_is_read_or_refused_and_never_ends_the_process(
    tmp_path_factory, blobs, data
):
    whole = bytearray(blobs.raw().SerializeToString())
    for _ in range(data.draw(st.integers(1, 8))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "spoiled.onnx"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole)))])
    try:
        open_graph(path)
    except ModelFileSpoiled as error:
        assert str(path) in str(error)


def endless() -> bytes:
    """A graph whose loop counts to 2^62."""
    whole, truth, number = TensorProto.INT64, TensorProto.BOOL, TensorProto.FLOAT
    tensor = helper.make_tensor_value_info
    body = helper.make_graph(
        [helper.make_node("Identity", [one], [f"{one}_next"]) for one in ("goes_on", "x")],
        "body",
        [tensor("i", whole, []), tensor("goes_on", truth, []), tensor("x", number, [1])],
        [tensor("goes_on_next", truth, []), tensor("x_next", number, [1])],
    )
    graph = helper.make_graph(
        [helper.make_node("Loop", ["count", "begins", "images"], ["output"], body=body)],
        "endless",
        [tensor("images", number, [1])],
        [tensor("output", number, [1])],
        [
            helper.make_tensor("count", whole, [], [2**62]),
            helper.make_tensor("begins", truth, [], [True]),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 9
    return bytes(model.SerializeToString())


def test_a_model_that_loops_for_ever_ends_at_its_first_run(tmp_path, cpu_choice, monkeypatch):
    monkeypatch.setattr(opening, "FIRST_RUNS_WITHIN_S", 0.2)
    path = tmp_path / "endless.onnx"
    path.write_bytes(endless())
    graph = open_graph(path, cpu_choice(threads=1))
    with pytest.raises(RunFailed, match=r"no answer within 0.2 s, it may loop for ever"):
        graph.run(["output"], {"images": np.zeros(1, np.float32)})
