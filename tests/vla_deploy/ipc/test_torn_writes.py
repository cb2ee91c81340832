"""Tear slots at every byte, as a killed writer or a weakly ordered processor would."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vla_deploy.ipc import PackedField, SharedSpace, Topic, TopicKind
from vla_deploy.ipc.memory.layout import file_name, layout_of

WORD_BYTES = 8
NEWEST_OFFSET = 96
NUMBER = Topic(
    name="number",
    kind=TopicKind.CELL,
    owner="a",
    summary="the same number in every field",
    fields=(PackedField("first", "f8"), PackedField("second", "u4"), PackedField("more", "f8", 6)),
)
NOTE = Topic(
    name="note",
    kind=TopicKind.CELL,
    owner="a",
    summary="n",
    fields=(PackedField("document", "json", 64),),
)
ACTS = Topic(name="acts", kind=TopicKind.RING, owner="any", summary="n", slots=4, slot_bytes=64)
VIEW = Topic(name="view", kind=TopicKind.FRAME, owner="a", summary="n", slots=4, slot_bytes=64)
OLD, BEFORE, NEW = 5, 8, 9  # OLD and NEW share a slot, BEFORE is the last whole one
reuse_fixtures = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=150
)


class Injector:
    """Hold a file's bytes before and after the NEW value, and mix its slot from both."""

    def __init__(self, directory: Path, topic: Topic) -> None:
        self.path = directory / file_name(topic)
        self.layout = layout_of(topic)
        self.before = b""
        self.after = b""

    def write(self, slot: bytes, newest: int) -> None:
        start = self.layout.offset(NEW)
        data = bytearray(self.after)
        data[start : start + len(slot)] = slot
        data[NEWEST_OFFSET : NEWEST_OFFSET + WORD_BYTES] = newest.to_bytes(WORD_BYTES, "little")
        with self.path.open("r+b") as file:
            file.write(data)

    def slots(self) -> tuple[bytes, bytes]:
        start, end = self.layout.offset(NEW), self.layout.offset(NEW) + self.layout.stride_bytes
        return self.before[start:end], self.after[start:end]

    def prefixes(self) -> list[bytes]:
        old, new = self.slots()
        return [new[:count] + old[count:] for count in range(len(new) + 1)]

    def shuffled(self, from_new: list[bool]) -> bytes:
        old, new = self.slots()
        words = range(0, len(new), WORD_BYTES)
        return b"".join(
            (new if from_new[at // WORD_BYTES] else old)[at : at + WORD_BYTES] for at in words
        )


def fill(injector: Injector, put) -> None:
    for number in range(1, BEFORE + 1):
        put(number)
    injector.before = injector.path.read_bytes()
    put(NEW)
    injector.after = injector.path.read_bytes()


@pytest.fixture
def space(tmp_path, clock) -> SharedSpace:
    return SharedSpace(tmp_path, clock, (NUMBER, NOTE, ACTS, VIEW))


@pytest.fixture
def number_cell(space, tmp_path) -> Injector:
    injector = Injector(tmp_path, NUMBER)
    writer = space.cell_writer("number")
    fill(injector, lambda n: writer.put(first=n, second=n, more=[n] * 6))
    return injector


def assert_whole(sample, allowed: set[int]) -> None:
    values = {sample.data["first"], sample.data["second"], *sample.data["more"], sample.sequence}
    assert len(values) == 1
    assert sample.sequence in allowed


@pytest.mark.parametrize("newest", [BEFORE, NEW])
def test_a_cell_torn_at_any_byte_gives_a_whole_value(space, number_cell, newest):
    for slot in number_cell.prefixes():
        number_cell.write(slot, newest)
        finished = newest == NEW and slot == number_cell.slots()[1]
        assert_whole(space.cell_reader("number").latest(), {NEW if finished else BEFORE})


@reuse_fixtures
@given(from_new=st.lists(st.booleans(), min_size=32, max_size=32))
def test_a_cell_whose_stores_arrive_in_any_order_gives_a_whole_value(space, number_cell, from_new):
    number_cell.write(number_cell.shuffled(from_new), NEW)
    reader = space.cell_reader("number")
    assert_whole(reader.latest(), {NEW, BEFORE})
    reader.close()


@reuse_fixtures
@given(garbage=st.binary(min_size=128, max_size=128))
def test_a_cell_overwritten_with_garbage_gives_the_value_before(space, number_cell, garbage):
    number_cell.write(garbage, NEW)
    reader = space.cell_reader("number")
    assert_whole(reader.latest(), {BEFORE})
    assert reader.torn == 1
    reader.close()


def test_a_reader_keeps_its_last_value_when_no_slot_is_whole(space, number_cell):
    reader = space.cell_reader("number")
    assert reader.latest().sequence == NEW
    with number_cell.path.open("r+b") as file:
        file.seek(number_cell.layout.offset(0))
        file.write(bytes(number_cell.layout.stride_bytes * number_cell.layout.slots))
        file.seek(NEWEST_OFFSET)
        file.write((NEW + 1).to_bytes(8, "little"))
    assert_whole(reader.latest(), {NEW})
    assert reader.torn > 0


def test_a_document_torn_at_any_byte_is_whole(space, tmp_path):
    injector, writer = Injector(tmp_path, NOTE), space.cell_writer("note")
    fill(injector, lambda n: writer.put_document({"n": n, "again": str(n) * n}))
    for slot in injector.prefixes():
        injector.write(slot, NEW)
        sample = space.cell_reader("note").latest()
        assert sample.document() == {
            "n": sample.sequence,
            "again": str(sample.sequence) * sample.sequence,
        }
        assert sample.sequence == (NEW if slot == injector.slots()[1] else BEFORE)


def test_a_torn_event_is_skipped_and_counted(space, tmp_path):
    injector, writer = Injector(tmp_path, ACTS), space.ring_writer("acts")
    fill(injector, lambda n: writer.publish({"n": n}))
    whole = injector.slots()[1]
    for slot in injector.prefixes():
        injector.write(slot, NEW)
        reader = space.ring_reader("acts", from_start=True)
        numbers = [event.payload["n"] for event in reader.drain()]
        expected = [6, 7, 8, 9] if slot == whole else [6, 7, 8]
        assert numbers == expected
        assert len(numbers) + reader.torn + reader.lost == NEW


def test_a_writer_killed_while_publishing_leaves_the_ring_usable(space, tmp_path):
    injector, writer = Injector(tmp_path, ACTS), space.ring_writer("acts")
    fill(injector, lambda n: writer.publish({"n": n}))
    for slot in injector.prefixes():
        injector.write(slot, BEFORE)  # killed before it raised the newest sequence
        reader = space.ring_reader("acts", from_start=False)
        assert space.ring_writer("acts").publish({"n": 90}) == NEW
        assert [event.payload["n"] for event in reader.drain()] == [90]


def test_an_image_torn_at_any_byte_gives_a_whole_one(space, tmp_path):
    injector, writer = Injector(tmp_path, VIEW), space.frame_writer("view")
    fill(injector, lambda n: writer.put(bytes([n]) * 64, width=n, height=n, stamp_ns=n))
    for slot in injector.prefixes():
        injector.write(slot, NEW)
        frame = space.frame_reader("view").latest()
        assert {*frame.payload, frame.width, frame.height, frame.stamp_ns} == {frame.sequence}
        assert frame.sequence == (NEW if slot == injector.slots()[1] else BEFORE)
