import pytest

from vla_deploy.ipc import BadPayload


def test_a_reader_gets_the_newest_image_with_its_size_and_stamp(space):
    writer, reader = space.frame_writer("view"), space.frame_reader("view")
    assert reader.latest() is None
    for n in range(5):
        writer.put(bytes([n]) * 24, width=4, height=6, stamp_ns=100 + n)
    frame = reader.latest()
    assert (frame.payload, frame.width, frame.height) == (b"\x04" * 24, 4, 6)
    assert (frame.stamp_ns, frame.sequence) == (104, 5)
    assert frame.age_s(1_000_000_104) == 1.0


def test_a_frame_does_not_change_when_the_writer_goes_on(space):
    writer = space.frame_writer("view")
    writer.put(b"a" * 96, width=8, height=12, stamp_ns=1)
    frame = space.frame_reader("view").latest()
    for _ in range(6):
        writer.put(b"b" * 96, width=8, height=12, stamp_ns=2)
    assert frame.payload == b"a" * 96


def test_an_image_beyond_the_slot_names_topic_size_and_limit(space):
    expected = "topic view: 10 x 10 image of 100 bytes, limit 96"
    with pytest.raises(BadPayload, match=expected):
        space.frame_writer("view").put(bytes(100), width=10, height=10, stamp_ns=1)
    assert space.frame_reader("view").latest() is None


def test_a_restarted_writer_goes_on_with_the_next_sequence(open_space):
    open_space().frame_writer("view").put(b"a", width=1, height=1, stamp_ns=1)
    open_space().frame_writer("view").put(b"b", width=1, height=1, stamp_ns=2)
    frame = open_space().frame_reader("view").latest()
    assert (frame.sequence, frame.payload) == (2, b"b")
