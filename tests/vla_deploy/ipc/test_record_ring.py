import pytest

from vla_deploy.ipc import BadPayload, SharedSpace, Topic, TopicKind

TOPIC = Topic(name="log", kind=TopicKind.RECORD, owner="a", summary="bytes", slots=8, slot_bytes=16)


@pytest.fixture
def space(tmp_path, clock):
    return SharedSpace(tmp_path / "ipc", clock, (TOPIC,))


def payloads(space, **since):
    return [record.payload for record in space.record_reader("log").held(**since)]


def test_records_come_back_in_order_whatever_their_length(space):
    writer = space.record_writer("log")
    sent = [b"", b"short", b"x" * 16, b"y" * 17, b"z" * 40]
    for payload in sent:
        writer.append(payload)
    assert payloads(space) == sent


def test_the_oldest_record_goes_as_a_whole_when_its_first_part_is_overwritten(space):
    writer = space.record_writer("log")
    writer.append(b"a" * 40)  # three slots
    for number in range(6):
        writer.append(bytes([number]))
    assert payloads(space) == [bytes([number]) for number in range(6)]


def test_records_before_a_moment_are_left_out(space, clock):
    writer = space.record_writer("log")
    writer.append(b"before")
    clock.time_ns += 10
    writer.append(b"after")
    assert payloads(space, since_ns=clock.time_ns) == [b"after"]


def test_records_outlive_their_writer_and_a_new_one_goes_on(space):
    first = space.record_writer("log")
    first.append(b"one")
    first.close()
    space.record_writer("log").append(b"two")
    assert payloads(space) == [b"one", b"two"]


def test_a_record_that_was_torn_is_left_out(space):
    writer = space.record_writer("log")
    for payload in (b"one", b"two", b"three"):
        writer.append(payload)
    segment = writer._segment
    segment.memory[segment.layout.offset(2) + 33] ^= 1
    assert payloads(space) == [b"one", b"three"]


def test_a_record_longer_than_half_of_the_ring_is_refused(space):
    with pytest.raises(BadPayload, match="record of 65 bytes, limit 64"):
        space.record_writer("log").append(bytes(65))


def test_fresh_records_come_once_and_what_was_before_is_not_among_them(space):
    writer = space.record_writer("log")
    writer.append(b"before")
    reader = space.record_reader("log")
    assert reader.fresh() == []
    writer.append(b"x" * 40)
    writer.append(b"new")
    assert [record.payload for record in reader.fresh()] == [b"x" * 40, b"new"]
    assert reader.fresh() == []
