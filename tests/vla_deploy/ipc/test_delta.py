from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.ipc import BadPayload
from vla_deploy.ipc.memory.delta import DeltaReader, DeltaWriter
from vla_deploy.ipc.memory.packing import Catalogue

NAMES = ("a", "b", "c")
values = st.none() | st.booleans() | st.integers(0, 3) | st.floats(0, 1) | st.sampled_from("xyz")


def writer(key_every=4):
    return DeltaWriter(NAMES, Catalogue(()), key_every=key_every)


def record(source: DeltaWriter, row: Any) -> bytes:
    source.put(0, row)
    return source.record()


@given(st.lists(st.tuples(values, values, values), max_size=12))
def test_every_row_comes_back_exactly(rows):
    source, reader = writer(), DeltaReader(())
    for row in rows:
        back = reader.row(record(source, row))
        assert repr(back) == repr(dict(zip(NAMES, row, strict=True)))


def test_an_array_that_is_altered_in_place_is_seen():
    source, reader, array = writer(key_every=100), DeltaReader(()), np.zeros(3)
    for number in range(3):
        array[:] = number
        row: dict[str, Any] | None = reader.row(record(source, (array, None, 1)))
        assert row is not None
        assert row["a"].tolist() == [number] * 3


def test_a_row_may_be_put_in_parts_and_its_arrays_altered_before_it_is_recorded():
    source, reader, array = writer(), DeltaReader(()), np.zeros(3)
    source.put(0, (array, 1))
    array[:] = 7.0
    source.put(2, ("sent",))
    row: dict[str, Any] | None = reader.row(source.record())
    assert row is not None
    assert (row["a"].tolist(), row["b"], row["c"]) == ([0.0] * 3, 1, "sent")


def test_what_stays_costs_nothing():
    source = writer(key_every=100)
    row = (np.arange(50.0), "text", 1.5)
    first, second = record(source, row), record(source, row)
    assert len(first) > 400
    assert len(second) == 9


def test_after_a_gap_rows_come_back_from_the_next_key_record_on():
    source, reader = writer(), DeltaReader(())
    records = [record(source, (number, "same", None)) for number in range(10)]
    del records[2]
    rows = [reader.row(record) for record in records]
    assert [row and row["a"] for row in rows] == [0, 1, None, 4, 5, 6, 7, 8, 9]


def test_a_reader_that_comes_later_waits_for_a_key_record():
    source, reader = writer(), DeltaReader(())
    rows = [reader.row(record(source, (number, 0, 0))) for number in range(9)][0:]
    assert rows[0] is not None
    late = DeltaReader(())
    assert late.row(record(source, (9, 0, 0))) is None


@pytest.mark.parametrize("record", [b"", b"1234567", b"\0\0\0\0\4\0\0\0{]x}"])
def test_bytes_that_are_no_record_are_refused(record):
    with pytest.raises(BadPayload, match="record"):
        DeltaReader(()).row(record)
