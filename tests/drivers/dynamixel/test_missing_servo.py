"""One dead servo of sixteen costs neither the others' values nor more than two milliseconds."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel import BlockLayout

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
