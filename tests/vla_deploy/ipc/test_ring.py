import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vla_deploy.ipc import BadPayload
from vla_deploy.ipc.memory.segment import _FORCED_WORD, _NEWEST_WORD

SLOTS = 8


def numbers(events) -> list[int]:
    return [event.payload["n"] for event in events]


def test_events_arrive_in_order_and_once(space, clock):
    reader, writer = space.ring_reader("acts", from_start=False), space.ring_writer("acts")
    clock.time_ns = 77
    for n in range(3):
        writer.publish({"n": n})
    events = reader.drain()
    assert numbers(events) == [0, 1, 2]
    assert [event.sequence for event in events] == [1, 2, 3]
    assert (events[0].stamp_ns, events[0].writer_pid) == (77, os.getpid())
    assert reader.drain() == []


def test_a_late_reader_begins_now_or_at_the_oldest_event(space):
    writer = space.ring_writer("acts")
    for n in range(3):
        writer.publish({"n": n})
    now, start = (space.ring_reader("acts", from_start=flag) for flag in (False, True))
    writer.publish({"n": 3})
    assert numbers(now.drain()) == [3]
    assert numbers(start.drain()) == [0, 1, 2, 3]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(bursts=st.lists(st.integers(0, 3 * SLOTS), max_size=8))
def test_each_event_is_read_once_or_counted_as_lost(open_space, bursts):
    space = open_space()
    writer, reader = space.ring_writer("acts"), space.ring_reader("acts", from_start=False)
    published = 0
    for burst in bursts:
        lost_before = reader.lost
        for _ in range(burst):
            writer.publish({"n": published})
            published += 1
        events = reader.drain()
        assert numbers(events) == list(range(published - min(burst, SLOTS), published))
        assert reader.lost - lost_before == max(0, burst - SLOTS)
    assert reader.torn == 0


def test_two_writers_share_one_sequence(space):
    reader = space.ring_reader("acts", from_start=False)
    first, second = space.ring_writer("acts"), space.ring_writer("acts")
    assert [w.publish({"n": n}) for n, w in enumerate((first, second, first))] == [1, 2, 3]
    assert numbers(reader.drain()) == [0, 1, 2]


def test_a_restarted_writer_goes_on_with_the_next_sequence(open_space):
    writer = open_space().ring_writer("acts")
    writer.publish({"n": 0})
    writer.close()
    assert open_space().ring_writer("acts").publish({"n": 1}) == 2


def test_a_payload_beyond_the_slot_names_topic_size_and_limit(space):
    writer, reader = space.ring_writer("acts"), space.ring_reader("acts", from_start=False)
    with pytest.raises(BadPayload, match="topic acts: document of 211 bytes, limit 128"):
        writer.publish({"text": "x" * 200})
    assert reader.drain() == []
    writer.publish({"n": 1})
    assert numbers(reader.drain()) == [1]


def test_a_payload_that_is_no_object_is_refused(space):
    with pytest.raises(BadPayload, match="topic acts: expected a JSON object, got list"):
        space.ring_writer("acts").publish([1, 2])


@pytest.mark.parametrize("word", [_NEWEST_WORD, _FORCED_WORD])
@pytest.mark.parametrize("act", ["publish", "force"])
def test_a_spoilt_counter_keeps_no_event_away(open_space, word, act):
    reader = open_space().ring_reader("acts", from_start=False)
    writer = open_space().ring_writer("acts")
    writer.publish({"n": 0})
    assert numbers(reader.drain()) == [0]
    writer._segment._words[word] = 2**64 - 1
    getattr(writer, act)({"n": 1})
    assert numbers(reader.drain()) == [1]
    getattr(writer, act)({"n": 2})
    assert numbers(reader.drain()) == [2]
    assert (reader.lost, reader.torn) == (0, 0)
