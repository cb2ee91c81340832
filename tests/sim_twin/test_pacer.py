import pytest

from sim_twin.contracts.scripted import ManualClock
from sim_twin.timing.pacer import Pacer, RealTimeFactor

MS = 1_000_000


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(0)


def test_time_is_no_faster_than_the_wall_clock(clock: ManualClock) -> None:
    pacer = Pacer(clock, is_fast=False)
    pacer.start(1000 * MS)
    assert pacer.wait_ns(1002 * MS) == 2 * MS
    clock.ns = 3 * MS
    assert pacer.wait_ns(1002 * MS) == 0


def test_a_small_delay_is_caught_up_with(clock: ManualClock) -> None:
    pacer = Pacer(clock, is_fast=False)
    pacer.start(0)
    clock.ns = 20 * MS
    assert [pacer.wait_ns(due * MS) for due in (2, 20, 22)] == [0, 0, 2 * MS]


def test_a_long_delay_is_not_caught_up_with(clock: ManualClock) -> None:
    pacer = Pacer(clock, is_fast=False)
    pacer.start(0)
    clock.ns = 1000 * MS
    assert [pacer.wait_ns(due * MS) for due in (2, 22, 24)] == [0, 0, 2 * MS]


def test_a_fast_twin_never_waits(clock: ManualClock) -> None:
    pacer = Pacer(clock, is_fast=True)
    pacer.start(0)
    assert pacer.wait_ns(10_000 * MS) == 0


def test_the_real_time_factor_is_that_of_the_last_whole_window() -> None:
    factor = RealTimeFactor(wall_ns=0, now_ns=0)
    assert not factor.update(500 * MS, 100 * MS)
    assert factor.value == 1.0
    assert factor.update(1000 * MS, 500 * MS)
    assert factor.value == 0.5
