import dataclasses

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.inference.manifest import ModelFile, Variant
from vla_deploy.inference.store import Model
from vla_deploy.perception.model_tools.benching import bench

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
def both(installed) -> Model:
    """Have the same graph as fp32 and as int8: the figures, not the files, are looked at here."""
    model = installed()
    original = model.manifest.files[Variant.FP32]
    files = {
        variant: ModelFile(path=original.path, sha256=original.sha256)
        for variant in (Variant.FP32, Variant.INT8_U8S8)
    }
    return dataclasses.replace(model, manifest=dataclasses.replace(model.manifest, files=files))


def test_every_file_is_measured_and_the_speedup_is_told(ticking, both, cpu_choice):
    figures = bench(ticking, both, cpu_choice(threads=1), NOISE, rounds=5)
    assert [row.variant for row in figures.rows] == [Variant.FP32, Variant.INT8_U8S8]
    for row in figures.rows:
        assert row.frames == 5
        assert (row.run_median_s, row.run_p95_s) == pytest.approx((0.001, 0.001))
        assert row.frame_median_s == pytest.approx(0.003)
    assert figures.int8_speedup == pytest.approx(1.0)
    assert figures.document()["rows"][1]["provider"] == "CPUExecutionProvider"


def test_a_model_with_one_file_has_no_speedup(ticking, installed, cpu_choice):
    figures = bench(ticking, installed(), cpu_choice(threads=1), NOISE, rounds=2)
    assert [row.variant for row in figures.rows] == [Variant.FP32]
    assert figures.int8_speedup is None
