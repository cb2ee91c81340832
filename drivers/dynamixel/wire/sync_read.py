"""Ask many servos for the same registers at once and understand what comes back."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    HEADER,
    Instruction,
    PacketParser,
    decode_fast_entries,
    encode_instruction,
)

STATUS_OVERHEAD_BYTES: Final = 11
_FAST_OVERHEAD_BYTES: Final = 8
_FAST_ENTRY_OVERHEAD_BYTES: Final = 4
_FAST_HEAD: Final = HEADER + bytes((BROADCAST_ID,))
_STATUS: Final = bytes((Instruction.STATUS,))


class Entry(NamedTuple):
    """Hold one servo's part of a sync read."""

    servo_id: int
    error: int
    data: bytes


class SyncRead:
    """Hold one sync read request and the shape of its reply."""

    def __init__(self, ids: Sequence[int], address: int, size: int, *, fast: bool) -> None:
        self.ids = tuple(ids)
        self.address = address
        self.size = size
        self.fast = fast
        instruction = Instruction.FAST_SYNC_READ if fast else Instruction.SYNC_READ
        head = address.to_bytes(2, "little") + size.to_bytes(2, "little")
        self.request = encode_instruction(BROADCAST_ID, instruction, head + bytes(self.ids))
        self.reply_bytes = (
            _FAST_OVERHEAD_BYTES + len(self.ids) * (size + _FAST_ENTRY_OVERHEAD_BYTES)
            if fast
            else len(self.ids) * (size + STATUS_OVERHEAD_BYTES)
        )


class ReplyCollector:
    """Frame a sync read's reply anew: for stuffed, damaged or incomplete ones."""

    def __init__(self, read: SyncRead) -> None:
        self._read = read
        self._wanted = set(read.ids)
        self._entries: dict[int, Entry] = {}
        self._parser = PacketParser()
        self._received = b""

    @property
    def complete(self) -> bool:
        """Return whether every servo has answered."""
        return len(self._entries) == len(self._wanted)

    @property
    def crc_errors(self) -> int:
        """Return how many frames had a wrong CRC."""
        return self._parser.crc_errors

    def feed(self, data: bytes) -> None:
        """Take received bytes."""
        if self._read.fast:
            self._received += data
            self._scan_fast_reply()
            return
        self._parser.feed(data)
        self._take_packets(salvage=False)

    def finish(self) -> dict[int, Entry]:
        """Return what was understood, by servo id; nothing more will come."""
        if not self._read.fast:
            self._take_packets(salvage=True)
        return self._entries

    def _take_packets(self, *, salvage: bool) -> None:
        packets = self._parser.salvage() if salvage else self._parser.packets()
        for packet in packets:
            if (
                packet.instruction == Instruction.STATUS
                and packet.error is not None
                and packet.servo_id in self._wanted
                and len(packet.params) == self._read.size
            ):
                # a late answer of an earlier cycle comes first, so the last one wins
                entry = Entry(packet.servo_id, packet.error, packet.params)
                self._entries[packet.servo_id] = entry

    def _scan_fast_reply(self) -> None:
        start = self._received.find(_FAST_HEAD)
        while start >= 0 and self._received[start + 7 : start + 8] != _STATUS:  # our own echo
            start = self._received.find(_FAST_HEAD, start + 1)
        if start < 0:
            return
        for error, servo_id, data in decode_fast_entries(self._received[start:], self._read.size):
            if servo_id in self._wanted:
                self._entries[servo_id] = Entry(servo_id, error, data)
