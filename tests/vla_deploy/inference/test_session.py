import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from onnx import TensorProto, helper

from vla_deploy.inference.errors import ModelMismatch, RunFailed
from vla_deploy.inference.manifest import Tensor, Variant
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import ModelStore

REPOSITORY = Path(__file__).parents[3]
MS = 1_000_000


class TickingClock:
    """Each look at it takes as long as told."""

    def __init__(self) -> None:
        self.ns = 0
        self.step_ns = 3 * MS

    def now_ns(self) -> int:
        self.ns += self.step_ns
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("a session never waits")


@pytest.fixture
def clock():
    return TickingClock()


@pytest.fixture
def session(tmp_path, lay_out, blob_manifest, blobs, cpu_choice, clock):
    lay_out(tmp_path, blob_manifest, {Variant.FP32: blobs.raw().SerializeToString()})
    model = ModelStore(tmp_path, tmp_path / "none").load("blobs")
    return open_session(model, cpu_choice(threads=1), engines=tmp_path / "e", clock=clock)


def image(value: float = 0.0) -> dict[str, np.ndarray]:
    return {"images": np.full((1, 3, 64, 96), value, dtype=np.float32)}


def test_a_run_gives_the_outputs_by_name(session):
    outputs = session.run(image())
    assert {name: value.shape for name, value in outputs.items()} == {"output": (1, 7, 96)}


def test_a_fresh_session_is_warm_and_has_counted_no_run(session):
    stats = session.stats()
    assert (stats.runs, stats.failures, stats.p50_s, stats.max_s) == (0, 0, 0, 0)
    assert stats.load_s == pytest.approx(0.003)


def test_runs_are_counted_with_their_latency(session, clock):
    for step_ms in (3, 3, 3, 50):
        clock.step_ns = step_ms * MS
        session.run(image())
    stats = session.stats()
    assert stats.runs == 4
    assert stats.p50_s == pytest.approx(0.003, rel=1 / 8)
    assert (stats.p95_s, stats.max_s) == (0.05, 0.05)
    assert stats.document()["variant"] == "fp32"
    assert (stats.threads, stats.role, stats.provider) == (1, "detector", "CPUExecutionProvider")


@pytest.mark.parametrize(
    ("inputs", "told"),
    [
        ({"images": np.zeros((1, 3, 64, 64), np.float32)}, "Got: 64 Expected: 96"),
        ({"images": np.zeros((1, 3, 64, 96))}, "Actual: (tensor(double))"),
        ({"image": np.zeros((1, 3, 64, 96), np.float32)}, "missing from input feed"),
    ],
)
def test_what_does_not_fit_fails_that_run_and_no_other(session, inputs, told):
    with pytest.raises(RunFailed) as caught:
        session.run(inputs)
    assert told in str(caught.value)
    session.run(image())
    assert (session.stats().failures, session.stats().runs) == (1, 1)


def test_a_closed_session_fails_and_does_not_crash(session):
    session.close()
    with pytest.raises(RunFailed, match=r"blobs.*: its session is closed"):
        session.run(image())


def test_outputs_that_come_out_otherwise_than_declared_are_found_at_the_start(
    tmp_path, lay_out, blob_manifest, cpu_choice, clock
):
    x = helper.make_tensor_value_info("x", TensorProto.FLOAT, [4])
    y = helper.make_tensor_value_info("y", TensorProto.INT64, [1, "n"])
    graph = helper.make_graph([helper.make_node("NonZero", ["x"], ["y"])], "any", [x], [y])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    manifest = dataclasses.replace(
        blob_manifest,
        role="planner",
        detection=None,
        inputs=(Tensor(name="x", shape=(4,), dtype="float32"),),
        outputs=(Tensor(name="y", shape=(1, 4), dtype="int64"),),
    )
    lay_out(tmp_path, manifest, {Variant.FP32: model.SerializeToString()})
    with pytest.raises(ModelMismatch) as caught:
        open_session(
            ModelStore(tmp_path, tmp_path / "none").load("blobs"),
            cpu_choice(),
            engines=tmp_path / "e",
            clock=clock,
        )
    assert str(caught.value) == "blobs: output 'y': expected shape [1, 4], the graph has [1, 0]"


# Run in a process of its own: what onnxruntime does, it does when it is loaded.
TELEMETRY = """
import os, sys, time
import numpy as np
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import ModelStore
from drivers.clock import MonotonicClock
from platforms import load_profile
from pathlib import Path
root = Path(sys.argv[1])
model = ModelStore(root, root / "none").load("blobs")
choice = load_profile("desktop").models["detector"]
session = open_session(model, choice, engines=root / "engines", clock=MonotonicClock())
for _ in range(3):  # the first two are watched by a timer's thread, which then ends
    session.run({"images": np.zeros((1, 3, 64, 96), np.float32)})
handles = []
for handle in os.listdir("/proc/self/fd"):
    try:
        handles.append(os.readlink(f"/proc/self/fd/{handle}"))
    except FileNotFoundError:
        continue

def threads():
    return len(os.listdir("/proc/self/task"))
# A joined thread of Python is for a moment still one of the kernel's.
until_s = time.monotonic() + 20
while threads() > 1 and time.monotonic() < until_s:
    time.sleep(0.01)
print("threads", threads())
print("sockets", sum(one.startswith("socket:") for one in handles))
print("files", sum("/home/" in one or one.endswith(".db") for one in handles))
"""


def test_onnxruntime_opens_and_sends_nothing_of_its_own(tmp_path, lay_out, blob_manifest, blobs):
    lay_out(tmp_path / "models", blob_manifest, {Variant.FP32: blobs.raw().SerializeToString()})
    home = tmp_path / "home"
    home.mkdir()
    # Neither CI nor ORT_DISABLE_TELEMETRY is in the environment: both would do the work for us.
    environment = {
        "HOME": str(home),
        "XDG_CACHE_HOME": str(home / "cache"),
        "TMPDIR": str(home),
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": str(REPOSITORY),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    done = subprocess.run(
        [sys.executable, "-c", TELEMETRY, str(tmp_path / "models")],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["threads", "1", "sockets", "0", "files", "0"]
    assert list(home.rglob("*")) == []
