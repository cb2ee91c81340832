"""Carry out instructions that address several servos by one packet, and the fast forms of them.

In a fast read the reply ends where a servo is missing, because each servo waits for the one before
it; a servo without fast reads counts as missing. A plain read goes on unless
`FirmwareOptions.sync_read_stops_at_missing`.
"""

import struct
from typing import Final

import numpy as np

from drivers.dynamixel.wire.codec import (
    ALERT,
    MAX_LENGTH,
    Instruction,
    Packet,
    encode_fast_status,
    encode_status,
)
from sim_twin.servos.firmware.firmware import Firmware
from sim_twin.servos.protocol.audience import Audience
from sim_twin.servos.protocol.params import GROUP_WRITES, READ_REQUESTS, Request, range_of
from sim_twin.servos.protocol.register_file import LOWEST_SLOT
from sim_twin.servos.protocol.registers import AccessRefused
from sim_twin.servos.protocol.speaker import ServoSpeaker, Store
from sim_twin.servos.protocol.timing import Reply
from sim_twin.servos.spec import FirmwareOptions

FAST_READS: Final = frozenset({Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ})
_SYNC_READS: Final = frozenset({Instruction.SYNC_READ, Instruction.FAST_SYNC_READ})

_FAST_OVERHEAD_BYTES: Final = 4  # error, id, CRC
_FAST_PREFIX_BYTES: Final = 8  # header .. instruction
_RANGE_BYTES: Final = 4  # address, length
_GOALS_HEAD: Final = struct.pack("<HH", 116, 4)
_GOAL: Final = np.dtype([("id", "u1"), ("pulse", "<i4")])


class GroupAccess:
    """Answer group reads and carry out group writes."""

    def __init__(
        self,
        firmware: Firmware,
        options: FirmwareOptions,
        audience: Audience,
        speaker: ServoSpeaker,
        store: Store,
    ) -> None:
        self._firmware = firmware
        self._options = options
        self._audience = audience
        self._speaker = speaker
        self._store = store
        self._tables = firmware.registers.tables

    def read(self, packet: Packet) -> list[Reply]:
        """Return what the servos answer to a group read.

        Raises:
            Refused: the params are too short to be meant for anybody.
        """
        fast = packet.instruction in FAST_READS
        if packet.instruction in _SYNC_READS:
            replies = self._read_block(packet.params, fast=fast)
            if replies:
                return replies
        requests = READ_REQUESTS[packet.instruction](packet.params)
        self._prepare(requests)
        return self._fast_replies(requests) if fast else self._plain_replies(requests)

    def write(self, packet: Packet) -> None:
        """Carry out a group write, which nobody answers.

        Raises:
            Refused: the params are too short to be meant for anybody.
        """
        if packet.instruction == Instruction.SYNC_WRITE and self._write_goals(packet.params):
            return
        writes = list(GROUP_WRITES[packet.instruction](packet.params))
        audience = self._audience
        audience.feed(row for write in writes for row in audience.named(write[0]))
        for servo_id, address, data in writes:
            for row in audience.named(servo_id):
                if audience.listens(row):
                    self._try_write(row, address, data)

    def _read_block(self, params: bytes, *, fast: bool) -> list[Reply]:
        """Answer the sync read that comes in every cycle in one go; none if it is another."""
        speaker = self._speaker
        if self._audience.deaf or speaker.faults.active or (fast and speaker.some_lack_fast):
            return []
        address, length = range_of(params)
        ids = params[_RANGE_BYTES:]
        rows = self._audience.group(ids)
        if not rows or len(rows) * (length + _FAST_OVERHEAD_BYTES) >= MAX_LENGTH:
            return []
        if address + length > LOWEST_SLOT:
            speaker.refresh(rows, address, length)
        spans = self._firmware.read_spans(rows, address, length)
        if not spans:
            return []
        self._audience.feed(rows)
        alerts = [ALERT if alert else 0 for alert in self._firmware.alerts(rows)]
        if fast:
            packet = encode_fast_status(list(zip(alerts, ids, spans, strict=True)))
            return [Reply(packet, speaker.return_delay_ns(rows[0]))]
        return [
            Reply(encode_status(servo_id, alert, span), speaker.return_delay_ns(row))
            for servo_id, alert, span, row in zip(ids, alerts, spans, rows, strict=True)
        ]

    def _prepare(self, requests: list[Request]) -> None:
        """Feed the watchdogs of those who are asked, and bring up to date what they will say."""
        wanted: dict[tuple[int, int], list[int]] = {}
        for servo_id, address, length in requests:
            wanted.setdefault((address, length), []).extend(self._audience.named(servo_id))
        for (address, length), rows in wanted.items():
            self._audience.feed(rows)
            self._speaker.refresh(rows, address, length)

    def _plain_replies(self, requests: list[Request]) -> list[Reply]:
        replies = []
        for servo_id, address, length in requests:
            row = self._audience.reader(servo_id)
            if row is not None:
                replies += self._speaker.answer(row, *self._speaker.read(row, address, length))
            elif self._options.sync_read_stops_at_missing:
                break
        return replies

    def _fast_replies(self, requests: list[Request]) -> list[Reply]:
        """Return the joint reply, cut where a servo is missing although LEN counts it."""
        if sum(length + _FAST_OVERHEAD_BYTES for _, _, length in requests) >= MAX_LENGTH:
            return []
        present: list[int] = []
        entries = []
        for servo_id, address, length in requests:
            row = self._audience.reader(servo_id)
            if row is None or not self._speaker.has_fast_reads(row):
                break
            error, data = self._speaker.read(row, address, length)
            entries.append((error, self._speaker.shown_id(row), data.ljust(length, b"\0")))
            present.append(row)
        if not present:
            return []
        absent = [(0, 0, bytes(length)) for _, _, length in requests[len(present) :]]
        return self._chain(present, encode_fast_status(entries + absent), requests)

    def _chain(self, rows: list[int], packet: bytes, requests: list[Request]) -> list[Reply]:
        """Cut the joint reply into what each servo says; it ends where one says nothing."""
        replies: list[Reply] = []
        start, late_ns = 0, 0
        for row, (_, _, length) in zip(rows, requests, strict=False):
            end = (start or _FAST_PREFIX_BYTES) + length + _FAST_OVERHEAD_BYTES
            late_ns += self._speaker.faults.late_ns(row)
            part = self._speaker.faults.spoil(row, packet[start:end])
            if not part:
                break
            delay_ns = 0 if start else self._speaker.return_delay_ns(row)
            replies.append(Reply(part, delay_ns, late_ns))
            start = end
        return replies

    def _write_goals(self, params: bytes) -> bool:
        """Carry out the sync write that comes in every cycle in one go; False if it is another."""
        whole = (len(params) - len(_GOALS_HEAD)) % _GOAL.itemsize == 0
        if self._audience.deaf or not whole or not params.startswith(_GOALS_HEAD):
            return False
        rows = self._audience.group(params[len(_GOALS_HEAD) :: _GOAL.itemsize])
        goals = np.frombuffer(params, _GOAL, offset=len(_GOALS_HEAD))["pulse"]
        if not rows or not self._firmware.take_goals(rows, goals):
            return False
        self._audience.feed(rows)
        return True

    def _try_write(self, row: int, address: int, data: bytes) -> None:
        try:
            writes = self._tables[row].check_write(address, data)
        except AccessRefused:  # nobody answers a sync or bulk write
            return
        self._store(row, writes)
