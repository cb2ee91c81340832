import mmap

import pytest

from vla_deploy.ipc.memory.layout import SlotLayout
from vla_deploy.ipc.memory.slot import SlotReader, SlotWriter

LAYOUT = SlotLayout(slots=3, capacity_bytes=64, stride_bytes=128)


class RacingMap(mmap.mmap):
    """Run `intrude` once, while the reader has copied the header but not yet the payload."""

    intrude = None

    def __getitem__(self, key):
        if self.intrude is not None and key.stop - key.start == LAYOUT.capacity_bytes:
            intrude, self.intrude = self.intrude, None
            intrude()
        return super().__getitem__(key)


@pytest.mark.parametrize("payload_crc", [True, False])
def test_a_writer_that_comes_around_during_the_copy_is_noticed(payload_crc):
    memory = RacingMap(-1, LAYOUT.file_bytes)
    writer = SlotWriter(memory, LAYOUT, payload_crc=payload_crc)
    reader = SlotReader(memory, LAYOUT, payload_crc=payload_crc)
    writer.write(1, 0, b"a" * 64)
    assert reader.read(1).payload == b"a" * 64
    memory.intrude = lambda: writer.write(4, 0, b"b" * 64)
    assert reader.read(1) is None
    assert reader.front(1) == 4
    assert reader.read(4).payload == b"b" * 64


def test_a_slot_of_another_sequence_is_not_taken():
    memory = mmap.mmap(-1, LAYOUT.file_bytes)
    SlotWriter(memory, LAYOUT, payload_crc=True).write(4, 0, b"")
    reader = SlotReader(memory, LAYOUT, payload_crc=True)
    assert reader.read(1) is None
    assert reader.read(4).payload == b""
