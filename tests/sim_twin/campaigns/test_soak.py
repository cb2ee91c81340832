"""The soak's judge detects growth and ignores noise."""

import ctypes
from pathlib import Path

import numpy as np
import pytest

from sim_twin.campaigns.soak import (
    LEAST_JOBS_RATIO,
    Soak,
    SoakSample,
    fill_cache_of_small_arrays,
    growth,
    jobs_case,
    judge,
)


class _Told(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks",
        "fordblks", "keepcost",
    )]  # fmt: skip


def _used_bytes() -> int:
    mallinfo2 = ctypes.CDLL(None).mallinfo2
    mallinfo2.restype = _Told
    return int(mallinfo2().uordblks)


def test_small_arrays_of_any_size_take_nothing_more_once_the_cache_is_full() -> None:
    fill_cache_of_small_arrays()
    before_bytes = _used_bytes()
    for size_bytes in range(1, 1024):
        np.empty(size_bytes, np.uint8)
    assert abs(_used_bytes() - before_bytes) < 4096


def samples(mib_per_h: float, *, files: int = 0, count: int = 80) -> list[SoakSample]:
    noise = np.random.default_rng(1).normal(0.0, 0.05, count)
    return [
        SoakSample(
            wall_h=n / count,
            sim_h=3.0 * n / count,
            memory_mib=200.0 + min(n, 5) * 10.0 + mib_per_h * 3.0 * n / count + noise[n],
            open_files=40 + (files * n) // count,
            threads=4,
            run_files=30,
            run_mib=12.0,
        )
        for n in range(count)
    ]


@pytest.mark.parametrize("slope", [0.0, 0.5, 4.0])
def test_growth_is_the_slope_after_the_warm_up(slope: float) -> None:
    assert growth(samples(slope), "memory_mib") == pytest.approx(slope, abs=0.1)


def test_a_leak_and_files_left_open_are_failures() -> None:
    failed = {case.name for case in judge(samples(2.0, files=6)) if case.failures}
    assert failed == {"memory", "open_files"}


def test_a_process_that_does_not_grow_passes() -> None:
    assert not any(case.failures for case in judge(samples(0.2)))


@pytest.mark.parametrize("count", [1, 5, 9])
def test_too_few_samples_say_nothing_of_growth(count: int) -> None:
    cases = judge(samples(9.0, files=6, count=count))
    assert [case.name for case in cases] == [case.name for case in judge(samples(0.0))]
    assert all("samples after the warm-up, expected 8" in case.skipped for case in cases)
    assert not any(case.failures for case in cases)


def test_too_few_samples_have_no_slope() -> None:
    with pytest.raises(ValueError, match="samples after the warm-up"):
        growth(samples(0.0, count=9), "memory_mib")


def test_a_robot_that_is_stuck_fails_and_one_that_misses_a_job_does_not() -> None:
    stuck, missed = jobs_case(40, 39), jobs_case(40, round(40 * (1.0 - LEAST_JOBS_RATIO)))
    assert stuck.failures == ("2% of 40 jobs ended well, expected 80% at least",)
    assert not missed.failures
    assert jobs_case(0, 0).failures


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_stop_costs_one_job_and_not_all_that_follow(tmp_path: Path) -> None:
    soak = Soak(tmp_path, seed=0)
    try:
        soak.stack.operate("estop")
        soak.stack.lockstep.run_for(1.0)
        soak.do("look left")
        soak.do("look left")
        assert (soak.stopped, len(soak.failed), soak.done) == (1, 1, 2)
    finally:
        soak.close()
