import dataclasses

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.detectors.benching import bench, memory_mb

NOISE = [np.random.default_rng(1).integers(0, 256, (64, 96, 3), dtype=np.uint8)]


class TickingClock:
    """Each look at it takes a millisecond."""

    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        self.ns += NS_PER_S // 1000
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("a benchmark never waits")


@pytest.fixture
def ticking(shelf):
    return dataclasses.replace(shelf, clock=TickingClock())


@pytest.fixture
def both(shelf, lay_out, blob_manifest, blobs) -> StoredModel:
    """Have the same graph as fp32 and as int8: the figures, not the files, are looked at here."""
    content = blobs.raw().SerializeToString()
    files = (Variant.FP32, Variant.INT8_U8S8)
    lay_out(shelf.store.user, blob_manifest, dict.fromkeys(files, content))
    return shelf.store.load("blobs")


def test_every_file_is_measured_and_the_speedup_is_told(ticking, both, cpu_choice):
    figures = bench(ticking, both, cpu_choice(threads=1), NOISE, rounds=5)
    assert [row.variant for row in figures.rows] == [Variant.FP32, Variant.INT8_U8S8]
    for row in figures.rows:
        assert row.frames == 5
        assert (row.run_median_s, row.run_p95_s) == pytest.approx((0.001, 0.001))
        assert row.frame_median_s == pytest.approx(0.003)
        assert row.memory_mb > 0
    assert figures.int8_speedup == pytest.approx(1.0)
    assert figures.document()["rows"][1]["provider"] == "CPUExecutionProvider"


def test_a_model_with_one_file_has_no_speedup(ticking, installed, cpu_choice):
    figures = bench(ticking, installed(), cpu_choice(threads=1), NOISE, rounds=2)
    assert [row.variant for row in figures.rows] == [Variant.FP32]
    assert figures.int8_speedup is None


def test_memory_is_measured_in_a_process_of_its_own_which_may_fail(ticking, both, cpu_choice):
    session = open_session(both, cpu_choice(), engines=ticking.engines, clock=ticking.clock)
    (both.folder / "model.toml").write_text("")
    with pytest.raises(RunFailed, match="blobs: no memory was measured: "):
        memory_mb(session, cpu_choice(), ticking)
