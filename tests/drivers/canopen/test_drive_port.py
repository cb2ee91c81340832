from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen import DriveSpec
from drivers.canopen.drive_port import DrivePort, counts_moved
from drivers.canopen.objects import TPDO2

INT32 = st.integers(-(2**31), 2**31 - 1)


def wrapped(counts: int) -> int:
    return (counts + 2**31) % 2**32 - 2**31


@given(start=INT32, moves=st.lists(st.integers(-(2**30), 2**30), max_size=20))
def test_the_position_follows_the_counter_through_any_number_of_wraps(
    start: int, moves: list[int]
) -> None:
    port = DrivePort(DriveSpec(node_id=1, joint="wheel"), 100_000_000)
    port.on_position(TPDO2.wire.pack(start, 0), 0)
    total = start
    for move in moves:
        total += move
        port.on_position(TPDO2.wire.pack(wrapped(total), 0), 0)
    assert port.position_rad == total / port.spec.counts_per_rad


@given(INT32, INT32)
def test_the_counter_moves_by_the_shorter_way(old: int, new: int) -> None:
    moved = counts_moved(old, new)
    assert wrapped(old + moved) == new
    assert -(2**31) <= moved < 2**31


@pytest.mark.parametrize(
    "wrong",
    [
        {"node_id": 0},
        {"node_id": 128},
        {"node_id": 127},
        {"sign": 0},
        {"counts_per_rev": 0},
        {"quick_stop_rad_s2": 0.0},
        {"acceleration_rad_s2": -1.0},
    ],
)
def test_a_spec_out_of_range_names_joint_and_field(wrong: dict[str, Any]) -> None:
    (field,) = wrong
    with pytest.raises(ValueError, match=f"drive wheel: {field}"):
        DriveSpec(**{"node_id": 1, "joint": "wheel", **wrong})
