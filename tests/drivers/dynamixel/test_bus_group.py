"""Several buses are read in the time of one, each as if it were alone."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel import BusGroup
from drivers.errors import DriverError

MakePaced = Callable[..., Any]


def connected(make_paced: MakePaced, counts: list[int], **options: Any) -> list[Any]:
    first = make_paced(counts[0], **options)
    benches = [first] + [make_paced(n, clock=first.clock, **options) for n in counts[1:]]
    for bench in benches:
        bench.bus.connect()
        bench.bus.read_state()
    return benches


def test_four_buses_take_the_time_of_one(make_paced: MakePaced) -> None:
    benches = connected(make_paced, [16, 16, 16, 16])
    alone_ns = benches[0].timed_read_ns()
    group = BusGroup([bench.bus for bench in benches])
    start_ns = benches[0].clock.ns
    assert group.read_states() == [None] * 4
    assert benches[0].clock.ns - start_ns <= alone_ns * 1.01
    assert all(bench.bus.state.valid.all() for bench in benches)


def test_each_bus_gets_its_own_values(make_paced: MakePaced) -> None:
    benches = connected(make_paced, [2, 3], fast_sync=False)
    for number, bench in enumerate(benches):
        bench.line.servos.rotors.position_rad[:] = 0.5 + number
    benches[0].clock.ns += 4_000_000
    BusGroup([bench.bus for bench in benches]).read_states()
    for number, bench in enumerate(benches):
        assert np.abs(bench.bus.state.position_rad - (0.5 + number)).max() < 0.01


def test_a_lost_bus_costs_the_others_nothing(make_paced: MakePaced) -> None:
    benches = connected(make_paced, [4, 4])
    benches[0].line.unplugged = True
    group = BusGroup([bench.bus for bench in benches])
    for _ in range(2):
        lost, fine = group.read_states()
        assert "unplugged" in str(lost)
        assert fine is None
        assert not benches[0].bus.state.valid.any()
        assert benches[1].bus.state.valid.all()


def test_a_group_of_none_or_of_a_bus_that_is_not_connected_is_refused(
    make_paced: MakePaced,
) -> None:
    with pytest.raises(ValueError, match="at least one bus"):
        BusGroup([])
    with pytest.raises(DriverError, match="call connect"):
        BusGroup([make_paced(2).bus]).read_states()
