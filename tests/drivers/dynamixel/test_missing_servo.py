"""A silent servo leaves the block read, and costs neither the others' values nor much time."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel import BlockLayout
from drivers.servo.roster import SUSPEND_AFTER, Roster


def test_a_servo_is_suspended_after_misses_in_a_row() -> None:
    roster = Roster(4)
    for _ in range(SUSPEND_AFTER - 1):
        assert roster.note_missing([2]) == ()
    assert roster.note_missing([2]) == (2,)
    assert roster.polled == (0, 1, 3)
    assert roster.suspended == (2,)


def test_misses_that_are_not_in_a_row_are_forgiven() -> None:
    roster = Roster(4)
    for _ in range(10):
        assert roster.note_missing([2]) == ()
        roster.note_complete()
    assert roster.suspended == ()


def test_only_who_is_blamed_every_time_is_suspended() -> None:
    roster = Roster(4)
    for other in (0, 2, 3):
        dropped = roster.note_missing([1, other])
    assert dropped == (1,)
    assert roster.polled == (0, 2, 3)


def test_at_least_one_servo_is_always_polled() -> None:
    roster = Roster(2)
    for _ in range(10):
        assert roster.note_missing([0, 1]) == ()
    assert roster.polled == (0, 1)


def test_a_resumed_servo_starts_with_a_clean_slate() -> None:
    roster = Roster(3)
    for _ in range(SUSPEND_AFTER):
        roster.note_missing([1])
    roster.resume(1)
    assert roster.polled == (0, 1, 2)
    assert roster.note_missing([1]) == ()


def test_the_last_servo_stays() -> None:
    roster = Roster(1)
    roster.suspend(0)
    assert roster.polled == (0,)


MakePaced = Callable[..., Any]
BYTE_NS = 10_000
READ_BYTES = {False: 30 + 16 * 21, True: 30 + 8 + 16 * 14}
MORE_BYTES = {BlockLayout.DIRECT: 0, BlockLayout.INDIRECT: 16 * 6}


@pytest.mark.parametrize("sleeping", [False, True], ids=["watching", "sleeping"])
@pytest.mark.parametrize("layout", [BlockLayout.DIRECT, BlockLayout.INDIRECT])
@pytest.mark.parametrize("fast_sync", [False, True])
@pytest.mark.parametrize("dead", [1, 8, 16])
def test_the_other_fifteen_are_delivered_in_every_cycle_in_bounded_time(
    make_paced: MakePaced, dead: int, fast_sync: bool, layout: BlockLayout, sleeping: bool
) -> None:
    bench = make_paced(fast_sync=fast_sync, layout=layout, health_every_cycles=5, sleeping=sleeping)
    bench.bus.connect()
    for _ in range(10):  # learns what is in time
        bench.bus.read_state()
    bench.bank.silence(dead)
    expected_ns = (READ_BYTES[fast_sync] + MORE_BYTES[layout]) * BYTE_NS
    others = np.arange(1, 17) != dead
    for _ in range(40):
        assert bench.timed_read_ns() <= expected_ns + 2_000_000
        assert bench.bus.state.valid.tolist() == others.tolist()
    assert bench.bus.counters.suspensions == 1
    bench.bank.silence(dead, silent=False)
    for _ in range(60):
        bench.bus.read_state()
    assert bench.bus.state.valid.all()
    assert bench.bus.counters.returns == 1
    assert f"servo {dead} (joint_{dead}, XM430-W350): answers again" in bench.bus.notices[-1]


@pytest.mark.parametrize("fast_sync", [False, True])
def test_a_cycle_takes_its_time_on_the_wire_and_no_more(
    make_paced: MakePaced, fast_sync: bool
) -> None:
    bench = make_paced(fast_sync=fast_sync)
    bench.bus.connect()
    bench.bus.read_state()
    assert bench.timed_read_ns() == READ_BYTES[fast_sync] * BYTE_NS


def test_a_whole_bus_that_falls_silent_is_noticed_in_one_bounded_cycle(
    make_paced: MakePaced,
) -> None:
    bench = make_paced(fast_sync=True)
    bench.bus.connect()
    for servo_id in range(1, 17):
        bench.bank.silence(servo_id)
    assert bench.timed_read_ns() <= READ_BYTES[True] * BYTE_NS + 2_000_000
    assert not bench.bus.state.valid.any()
    assert bench.bus.counters.suspensions == 0


def test_an_adapter_that_holds_a_reply_back_until_it_is_over_is_not_cut_short(
    make_paced: MakePaced,
) -> None:
    bench = make_paced(fast_sync=True, chunk_bytes=4096)
    bench.bus.connect()
    for _ in range(10):
        assert bench.timed_read_ns() == READ_BYTES[True] * BYTE_NS
        assert bench.bus.state.valid.all()
    bench.bank.silence(4)
    for _ in range(10):
        assert bench.timed_read_ns() <= READ_BYTES[True] * BYTE_NS + 2_000_000
    assert np.count_nonzero(bench.bus.state.valid) == 15
    assert bench.bus.counters.late == bench.bus.counters.discarded_bytes == 0
