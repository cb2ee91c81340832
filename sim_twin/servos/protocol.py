"""Carry out Protocol 2.0 instructions on the servos of one bus and collect their replies.

Only servos that are addressed, powered, booted and not silenced take part; they answer in the order
of the request, to a broadcast ping in the order of ids. In a fast sync or bulk read the reply ends
where a servo is missing, because each servo waits for the one before it; a plain one goes on unless
`FirmwareOptions.sync_read_stops_at_missing`. The control table backup is refused as an undefined
instruction. Return delay and secondary id are stored without effect.
"""

import struct
from collections.abc import Callable, Iterable
from typing import Final

import numpy as np

from drivers.dynamixel.codec import (
    ALERT,
    BROADCAST_ID,
    MAX_LENGTH,
    Instruction,
    Packet,
    StatusError,
    encode_fast_status,
    encode_status,
)
from drivers.dynamixel.control_table import Register, StatusReturnLevel
from sim_twin.servos.firmware import Firmware
from sim_twin.servos.params import GROUP_WRITES, READ_REQUESTS, Request, address_of, range_of
from sim_twin.servos.registers import Refused
from sim_twin.servos.spec import FirmwareOptions

_PING: Final = struct.Struct("<HB")
_CLEAR_TURNS: Final = b"\x01\x44\x58\x4c\x22"
_RESET_EVERYTHING: Final = 0xFF
_FAST_OVERHEAD_BYTES: Final = 4  # error, id, CRC
_FAST_PREFIX_BYTES: Final = 8  # header .. instruction
_RANGE_BYTES: Final = 4  # address, length
_GOALS_HEAD: Final = struct.pack("<HH", 116, 4)
_GOAL: Final = np.dtype([("id", "u1"), ("pulse", "<i4")])
_FAST: Final = frozenset({Instruction.FAST_SYNC_READ, Instruction.FAST_BULK_READ})

_REPLY_LEVELS: Final[dict[int, StatusReturnLevel]] = {
    Instruction.PING: StatusReturnLevel.PING,
    Instruction.READ: StatusReturnLevel.READ,
}
"""The status_return_level an instruction needs for an answer; all others need ALL."""


class BusProtocol:
    """Take packets, give replies; `silenced` and `corrupted` are the faults of single servos."""

    def __init__(self, firmware: Firmware, options: FirmwareOptions) -> None:
        self._firmware = firmware
        self._options = options
        self._tables = firmware.registers.tables
        self._registered: dict[int, list[tuple[Register, int]]] = {}
        self._actions: dict[int, Callable[[int, bytes], bytes]] = {
            Instruction.PING: self._ping,
            Instruction.READ: self._read,
            Instruction.WRITE: self._write,
            Instruction.REG_WRITE: self._reg_write,
            Instruction.ACTION: self._action,
            Instruction.FACTORY_RESET: self._factory_reset,
            Instruction.REBOOT: self._reboot,
            Instruction.CLEAR: self._clear,
        }
        self.silenced: set[int] = set()
        self.corrupted: set[int] = set()
        self.rows: dict[int, int] = {}
        self._groups: dict[bytes, list[int]] = {}
        self._index_ids()

    def execute(self, packet: Packet) -> bytes:
        """Return what the servos answer to a packet."""
        if packet.instruction == Instruction.STATUS:  # an echo, or another servo's answer
            return b""
        try:
            if packet.instruction in READ_REQUESTS:
                return self._group_read(packet)
            if packet.instruction in GROUP_WRITES:
                return self._group_write(packet)
        except Refused:  # too short to be meant for anybody
            return b""
        return b"".join(self._single(row, packet) for row in self._addressed(packet))

    # One servo, or all by broadcast

    def _addressed(self, packet: Packet) -> list[int]:
        if packet.servo_id == BROADCAST_ID:
            rows = [self.rows[servo_id] for servo_id in sorted(self.rows)]
        else:
            rows = [self.rows[packet.servo_id]] if packet.servo_id in self.rows else []
        self._feed(rows)
        return [row for row in rows if self._listens(row)]

    def _single(self, row: int, packet: Packet) -> bytes:
        table = self._tables[row]
        servo_id, alert = table.get("id"), self._alert(row)
        level = _REPLY_LEVELS.get(packet.instruction, StatusReturnLevel.ALL)
        answers = table.get("status_return_level") >= level and (
            packet.servo_id != BROADCAST_ID or packet.instruction == Instruction.PING
        )
        error, data = self._try(row, packet)
        return self._status(row, servo_id, alert | error, data) if answers else b""

    def _try(self, row: int, packet: Packet) -> tuple[int, bytes]:
        action = self._actions.get(packet.instruction)
        if action is None:
            return StatusError.INSTRUCTION, b""
        if packet.instruction == Instruction.FACTORY_RESET and self._is_refused_reset(packet):
            return StatusError.RESULT_FAIL, b""
        try:
            return StatusError.NONE, action(row, packet.params)
        except Refused as refusal:
            return refusal.number, b""

    def _is_refused_reset(self, packet: Packet) -> bool:
        """Tell whether a broadcast asks to reset ids too, which would make all of them equal."""
        return packet.servo_id == BROADCAST_ID and packet.params[:1] == bytes([_RESET_EVERYTHING])

    def _ping(self, row: int, _params: bytes) -> bytes:
        table = self._tables[row]
        return _PING.pack(table.get("model_number"), table.get("firmware_version"))

    def _read(self, row: int, params: bytes) -> bytes:
        address, length = range_of(params)
        self._firmware.refresh(address, length)
        return self._tables[row].read(address, length)

    def _write(self, row: int, params: bytes) -> bytes:
        self._store(row, self._tables[row].check_write(address_of(params), params[2:]))
        return b""

    def _reg_write(self, row: int, params: bytes) -> bytes:
        self._registered[row] = self._tables[row].check_write(address_of(params), params[2:])
        self._tables[row].put("registered_instruction", 1)
        return b""

    def _action(self, row: int, _params: bytes) -> bytes:
        if not self._tables[row].get("registered_instruction"):
            raise Refused(StatusError.INSTRUCTION)
        self._tables[row].put("registered_instruction", 0)
        self._store(row, self._registered.pop(row))
        return b""

    def _factory_reset(self, row: int, params: bytes) -> bytes:
        if len(params) != 1:
            raise Refused(StatusError.DATA_LENGTH)
        if self._tables[row].get("torque_enable"):
            raise Refused(StatusError.ACCESS)
        self._firmware.factory_reset(row, params[0])
        self._index_ids()
        return b""

    def _reboot(self, row: int, _params: bytes) -> bytes:
        self._firmware.reboot(row)
        return b""

    def _clear(self, row: int, params: bytes) -> bytes:
        if params != _CLEAR_TURNS:
            raise Refused(StatusError.DATA_RANGE)
        if not self._firmware.clear_turns(row):
            raise Refused(StatusError.RESULT_FAIL)
        return b""

    # Several servos by one packet

    def _group_read(self, packet: Packet) -> bytes:
        if packet.instruction == Instruction.FAST_SYNC_READ:
            reply = self._read_block(packet.params)
            if reply:
                return reply
        requests = READ_REQUESTS[packet.instruction](packet.params)
        self._feed(self._known(request[0] for request in requests))
        for address, length in {request[1:] for request in requests}:
            self._firmware.refresh(address, length)
        if packet.instruction in _FAST:
            return self._fast_reply(requests)
        replies = []
        for servo_id, address, length in requests:
            row = self._reader(servo_id)
            if row is None and self._options.sync_read_stops_at_missing:
                break
            if row is not None:
                error, data = self._entry(row, address, length)
                replies.append(self._status(row, servo_id, error, data))
        return b"".join(replies)

    def _read_block(self, params: bytes) -> bytes:
        """Answer the fast sync read that comes in every cycle in one go; b"" if it is another."""
        if self.silenced or self.corrupted:
            return b""
        address, length = range_of(params)
        ids = params[_RANGE_BYTES:]
        rows = self._group(ids)
        if not rows or len(rows) * (length + _FAST_OVERHEAD_BYTES) >= MAX_LENGTH:
            return b""
        spans = self._firmware.read_spans(rows, address, length)
        if not spans:
            return b""
        self._feed(rows)
        alerts = [ALERT if alert else 0 for alert in self._firmware.alerts(rows)]
        return encode_fast_status(list(zip(alerts, ids, spans, strict=True)))

    def _fast_reply(self, requests: list[Request]) -> bytes:
        """Return the joint reply, cut where a servo is missing although LEN counts it."""
        if sum(length + _FAST_OVERHEAD_BYTES for _, _, length in requests) >= MAX_LENGTH:
            return b""
        entries, intact_bytes, whole = [], _FAST_PREFIX_BYTES, True
        for servo_id, address, length in requests:
            row = self._reader(servo_id)
            whole = whole and row is not None
            error, data = (0, b"") if row is None else self._entry(row, address, length)
            entries.append((error, servo_id, data.ljust(length, b"\0")))
            intact_bytes += length + _FAST_OVERHEAD_BYTES if whole else 0
        if intact_bytes == _FAST_PREFIX_BYTES:  # the servo that writes the header is not there
            return b""
        return self._spoil_fast(encode_fast_status(entries)[:intact_bytes], requests)

    def _spoil_fast(self, reply: bytes, requests: list[Request]) -> bytes:
        spoiled, end = bytearray(reply), _FAST_PREFIX_BYTES
        for servo_id, _, length in requests:
            end += length + _FAST_OVERHEAD_BYTES
            row = self.rows.get(servo_id)
            if row in self.corrupted and end <= len(spoiled):
                self.corrupted.discard(row)
                spoiled[end - 1] ^= 0xFF
        return bytes(spoiled)

    def _entry(self, row: int, address: int, length: int) -> tuple[int, bytes]:
        try:
            return self._alert(row), self._tables[row].read(address, length)
        except Refused as refusal:
            return self._alert(row) | refusal.number, b""

    def _group_write(self, packet: Packet) -> bytes:
        if packet.instruction == Instruction.SYNC_WRITE and self._write_goals(packet.params):
            return b""
        writes = list(GROUP_WRITES[packet.instruction](packet.params))
        self._feed(self._known(write[0] for write in writes))
        for servo_id, address, data in writes:
            row = self.rows.get(servo_id)
            if row is not None and self._listens(row):
                self._try_write(row, address, data)
        return b""

    def _write_goals(self, params: bytes) -> bool:
        """Carry out the sync write that comes in every cycle in one go; False if it is another."""
        whole = (len(params) - len(_GOALS_HEAD)) % _GOAL.itemsize == 0
        if self.silenced or not whole or not params.startswith(_GOALS_HEAD):
            return False
        rows = self._group(params[len(_GOALS_HEAD) :: _GOAL.itemsize])
        goals = np.frombuffer(params, _GOAL, offset=len(_GOALS_HEAD))["pulse"]
        if not rows or not self._firmware.take_goals(rows, goals):
            return False
        self._feed(rows)
        return True

    def _group(self, ids: bytes) -> list[int]:
        """Return the rows of servos that a packet names again and again; none if one is odd."""
        if ids not in self._groups:
            rows = self._known(ids)
            self._groups = {ids: rows if len(set(rows)) == len(ids) else []}
        return self._groups[ids]

    def _try_write(self, row: int, address: int, data: bytes) -> None:
        try:
            writes = self._tables[row].check_write(address, data)
        except Refused:  # nobody answers a sync or bulk write
            return
        self._store(row, writes)

    # Shared by both

    def _store(self, row: int, writes: list[tuple[Register, int]]) -> None:
        self._firmware.store(row, writes)
        if any(register.name == "id" for register, _ in writes):
            self._index_ids()

    def _status(self, row: int, servo_id: int, error: int, data: bytes) -> bytes:
        reply = encode_status(servo_id, error, data)
        if row in self.corrupted:
            self.corrupted.discard(row)
            return reply[:-1] + bytes([reply[-1] ^ 0xFF])
        return reply

    def _alert(self, row: int) -> int:
        return ALERT if self._tables[row].get("hardware_error_status") else 0

    def _reader(self, servo_id: int) -> int | None:
        row = self.rows.get(servo_id)
        if row is None or not self._listens(row):
            return None
        level = self._tables[row].get("status_return_level")
        return row if level >= StatusReturnLevel.READ else None

    def _listens(self, row: int) -> bool:
        return row not in self.silenced and self._firmware.answers(row)

    def _known(self, servo_ids: Iterable[int]) -> list[int]:
        return [self.rows[servo_id] for servo_id in servo_ids if servo_id in self.rows]

    def _feed(self, rows: list[int]) -> None:
        every_row = range(len(self._tables))
        heard = every_row if self._options.watchdog_fed_by_any_packet else rows
        self._firmware.feed_watchdog([row for row in heard if row not in self.silenced])

    def _index_ids(self) -> None:
        """Map ids to servos; of two servos with one id the first answers."""
        ids = [table.get("id") for table in self._tables]
        self.rows = {ids[row]: row for row in reversed(range(len(ids)))}
        self._groups.clear()
