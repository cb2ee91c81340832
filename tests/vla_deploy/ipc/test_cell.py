import os

import numpy as np
import pytest

from vla_deploy.ipc import BadPayload


def put_pair(writer, number: int) -> None:
    writer.put(x_m=number / 2, count=number, values=[number, 0.0, -number])


def test_a_reader_gets_none_before_the_first_put(space):
    assert space.cell_reader("pair").latest() is None


def test_a_reader_opened_before_any_writer_sees_its_value(space, clock):
    reader = space.cell_reader("pair")
    clock.time_ns = 5_000
    put_pair(space.cell_writer("pair"), 4)
    sample = reader.latest()
    assert sample.data["x_m"] == 2.0
    assert sample.data["values"].tolist() == [4.0, 0.0, -4.0]
    assert (sample.stamp_ns, sample.sequence, sample.writer_pid) == (5_000, 1, os.getpid())
    assert sample.age_s(1_000_005_000) == 1.0


def test_a_reader_gets_the_newest_of_many(space):
    writer, reader = space.cell_writer("pair"), space.cell_reader("pair")
    for number in range(1, 50):
        put_pair(writer, number)
    assert reader.latest().data["count"] == 49
    assert reader.latest().sequence == 49


def test_a_sample_does_not_change_when_the_writer_goes_on(space):
    writer, reader = space.cell_writer("pair"), space.cell_reader("pair")
    put_pair(writer, 1)
    sample = reader.latest()
    for number in range(2, 12):
        put_pair(writer, number)
    assert sample.data["count"] == 1


def test_a_restarted_writer_goes_on_with_the_next_sequence(open_space):
    first = open_space().cell_writer("pair")
    put_pair(first, 1)
    put_pair(first, 2)
    first.close()
    put_pair(open_space().cell_writer("pair"), 3)
    sample = open_space().cell_reader("pair").latest()
    assert (sample.sequence, sample.data["count"]) == (3, 3)


def test_a_filled_record_is_published_by_commit_only(space):
    writer, reader = space.cell_writer("pair"), space.cell_reader("pair")
    writer.record["x_m"] = 1.5
    writer.record["values"][:2] = (7.0, 8.0)
    assert reader.latest() is None
    writer.commit()
    assert reader.latest().data["values"].tolist() == [7.0, 8.0, 0.0]


def test_a_shorter_array_leaves_zeros_behind_it(space):
    writer, reader = space.cell_writer("pair"), space.cell_reader("pair")
    writer.put(x_m=0, count=0, values=np.ones(3))
    writer.put(x_m=0, count=0, values=[2.0])
    assert reader.latest().data["values"].tolist() == [2.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"x_m": 0.0, "count": 1}, r"topic pair: missing \['values'\]"),
        ({"x_m": 0.0, "count": 1, "values": [1], "y_m": 0}, r"unknown \['y_m'\]"),
        ({"x_m": 0.0, "count": 1, "values": [1, 2, 3, 4]}, "field values: .* x 3: got 4 values"),
        ({"x_m": "far", "count": 1, "values": [1]}, "field x_m: expected float64"),
        ({"x_m": 0.0, "count": -1, "values": [1]}, "field count: expected uint32"),
    ],
)
def test_wrong_fields_are_refused_and_leave_the_old_value(space, fields, message):
    writer, reader = space.cell_writer("pair"), space.cell_reader("pair")
    put_pair(writer, 6)
    with pytest.raises(BadPayload, match=message):
        writer.put(**fields)
    assert reader.latest().data["count"] == 6


def test_a_document_comes_back_as_it_was_put(space):
    document = {"état": "läuft", "age_s": 0.25, "list": [1, None, True]}
    space.cell_writer("note").put_document(document)
    assert space.cell_reader("note").latest().document() == document


def test_a_document_beyond_its_bound_names_topic_size_and_limit(space):
    with pytest.raises(BadPayload, match="topic note: document of 309 bytes, limit 200"):
        space.cell_writer("note").put_document({"text": "x" * 298})


@pytest.mark.parametrize("value", [float("nan"), object(), np.float64("inf"), "\ud800"])
def test_what_json_cannot_say_is_refused(space, value):
    with pytest.raises(BadPayload, match="topic note: not JSON"):
        space.cell_writer("note").put_document({"value": value})


def test_packed_and_document_calls_are_not_mixed_up(space):
    note, pair = space.cell_writer("note"), space.cell_writer("pair")
    with pytest.raises(BadPayload, match=r"call put_document\(\)"):
        note.put(document="x")
    with pytest.raises(BadPayload, match=r"call put\(\)"):
        pair.put_document({})
    note.put_document({})
    put_pair(pair, 1)
    with pytest.raises(BadPayload, match=r"call document\(\)"):
        _ = space.cell_reader("note").latest().data
    with pytest.raises(BadPayload, match=r"read data\[name\]"):
        space.cell_reader("pair").latest().document()
