"""Carry out Protocol 2.0 instructions on the servos of one bus and collect their replies.

Only servos that are addressed, powered, booted and not cut off take part; they answer in the order
of the request, to a broadcast ping in the order of ids. A packet to a secondary id is carried out
and not answered. Servos that were given one id all obey and answer at once, which is heard as
garbage. A packet with a wrong check sum is answered with error 3 by the servo it names.
"""

import struct
from collections.abc import Callable
from typing import Final

from drivers.dynamixel.tables.control_table import Register, StatusReturnLevel
from drivers.dynamixel.wire.codec import ALERT, BROADCAST_ID, Instruction, Packet, StatusError
from sim_twin.servos.firmware.firmware import Firmware
from sim_twin.servos.protocol.audience import Audience
from sim_twin.servos.protocol.groups import FAST_READS, GroupAccess
from sim_twin.servos.protocol.instructions import BrokenPacket
from sim_twin.servos.protocol.params import GROUP_WRITES, READ_REQUESTS, address_of, range_of
from sim_twin.servos.protocol.registers import AccessRefused
from sim_twin.servos.protocol.speaker import ServoSpeaker
from sim_twin.servos.protocol.timing import Reply
from sim_twin.servos.protocol.wire_faults import WireFaults
from sim_twin.servos.spec import FirmwareOptions

_PING: Final = struct.Struct("<HB")
_CLEAR_TURNS: Final = b"\x01\x44\x58\x4c\x22"
_BACK_UP: Final = b"\x01CTRL"
_RESTORE: Final = b"\x02CTRL"
_RESET_EVERYTHING: Final = 0xFF
_ROSTER_REGISTERS: Final = frozenset({"id", "secondary_id", "baud_rate"})

_REPLY_LEVELS: Final[dict[int, StatusReturnLevel]] = {
    Instruction.PING: StatusReturnLevel.PING,
    Instruction.READ: StatusReturnLevel.READ,
}
"""The status_return_level an instruction needs for an answer; all others need ALL."""


class BusProtocol:
    """Take packets, give replies."""

    def __init__(self, firmware: Firmware, options: FirmwareOptions) -> None:
        self.audience = Audience(firmware, options)
        self.speaker = ServoSpeaker(firmware)
        self._firmware = firmware
        self._tables = firmware.registers.tables
        self._groups = GroupAccess(firmware, options, self.audience, self.speaker, self._store)
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
            Instruction.CONTROL_TABLE_BACKUP: self._back_up,
        }

    @property
    def faults(self) -> WireFaults:
        """Return what spoils replies."""
        return self.speaker.faults

    def freeze(self, row: int) -> None:
        """Let a servo show for ever what it senses now."""
        self.speaker.freeze(row)

    def execute(self, packet: Packet | BrokenPacket) -> list[Reply]:
        """Return what the servos answer to a packet."""
        if packet.instruction == Instruction.STATUS:  # an echo, or another servo's answer
            return []
        if isinstance(packet, BrokenPacket):
            return self._complain(packet)
        try:
            if packet.instruction in READ_REQUESTS and not self._too_new(packet):
                return self._groups.read(packet)
            if packet.instruction in GROUP_WRITES:
                self._groups.write(packet)
                return []
        except AccessRefused:  # too short to be meant for anybody
            return []
        return self._address(packet)

    def _too_new(self, packet: Packet) -> bool:
        """Return whether one servo is asked for a fast read that it does not know."""
        if packet.instruction not in FAST_READS or packet.servo_id == BROADCAST_ID:
            return False
        rows = self.audience.named(packet.servo_id)
        return any(not self.speaker.has_fast_reads(row) for row in rows)

    # Who is meant, and whether they answer

    def _address(self, packet: Packet) -> list[Reply]:
        audience = self.audience
        everyone = packet.servo_id == BROADCAST_ID
        rows = audience.everyone() if everyone else audience.named(packet.servo_id)
        followers = audience.followers(packet.servo_id)
        audience.feed([*rows, *followers])
        replies: dict[int, list[Reply]] = {}
        for row in [row for row in (*rows, *followers) if audience.listens(row)]:
            servo_id = self._tables[row].get("id") if everyone else packet.servo_id
            reply = self._single(row, packet)
            if row not in followers:
                replies[servo_id] = replies.get(servo_id) or reply
        return [reply for each in replies.values() for reply in each]

    def _single(self, row: int, packet: Packet) -> list[Reply]:
        servo_id, alert = self._tables[row].get("id"), self.speaker.alert(row)
        broadcast = packet.servo_id == BROADCAST_ID and packet.instruction != Instruction.PING
        answers = self._answers(row, packet.instruction) and not broadcast
        delay_ns = self.speaker.return_delay_ns(row)
        error, data = self._try(row, packet)
        if not answers:
            return []
        replies = self.speaker.answer(row, alert | error, data, servo_id)
        return [reply._replace(return_delay_ns=delay_ns) for reply in replies]

    def _complain(self, packet: BrokenPacket) -> list[Reply]:
        """Answer a packet with a wrong check sum, by the first servo of that id."""
        for row in self.audience.named(packet.servo_id):
            if self.audience.listens(row) and self._answers(row, packet.instruction):
                return self.speaker.answer(row, self.speaker.alert(row) | StatusError.CRC, b"")
        return []

    def _answers(self, row: int, instruction: int) -> bool:
        level = _REPLY_LEVELS.get(instruction, StatusReturnLevel.ALL)
        return self._tables[row].get("status_return_level") >= level

    def _try(self, row: int, packet: Packet) -> tuple[int, bytes]:
        action = self._actions.get(packet.instruction)
        if action is None:
            return StatusError.INSTRUCTION, b""
        if packet.instruction == Instruction.FACTORY_RESET and self._is_refused_reset(packet):
            return StatusError.RESULT_FAIL, b""
        try:
            return StatusError.NONE, action(row, packet.params)
        except AccessRefused as refusal:
            return refusal.number, b""

    def _is_refused_reset(self, packet: Packet) -> bool:
        """Return whether a broadcast asks to reset ids too, which would make all of them equal."""
        return packet.servo_id == BROADCAST_ID and packet.params[:1] == bytes([_RESET_EVERYTHING])

    # What one servo does

    def _ping(self, row: int, _params: bytes) -> bytes:
        table = self._tables[row]
        return _PING.pack(table.get("model_number"), table.get("firmware_version"))

    def _read(self, row: int, params: bytes) -> bytes:
        address, length = range_of(params)
        self.speaker.refresh((row,), address, length)
        error, data = self.speaker.read(row, address, length)
        if error & ~ALERT:
            raise AccessRefused(StatusError(error & ~ALERT))
        return data

    def _write(self, row: int, params: bytes) -> bytes:
        self._store(row, self._tables[row].check_write(address_of(params), params[2:]))
        return b""

    def _reg_write(self, row: int, params: bytes) -> bytes:
        self._registered[row] = self._tables[row].check_write(address_of(params), params[2:])
        self._tables[row].put("registered_instruction", 1)
        return b""

    def _action(self, row: int, _params: bytes) -> bytes:
        if not self._tables[row].get("registered_instruction"):
            raise AccessRefused(StatusError.INSTRUCTION)
        self._tables[row].put("registered_instruction", 0)
        self._store(row, self._registered.pop(row))
        return b""

    def _factory_reset(self, row: int, params: bytes) -> bytes:
        if len(params) != 1:
            raise AccessRefused(StatusError.DATA_LENGTH)
        if self._tables[row].get("torque_enable"):
            raise AccessRefused(StatusError.ACCESS)
        self._firmware.factory_reset(row, params[0])
        self._index()
        return b""

    def _reboot(self, row: int, _params: bytes) -> bytes:
        self._firmware.reboot(row)
        return b""

    def _clear(self, row: int, params: bytes) -> bytes:
        if params != _CLEAR_TURNS:
            raise AccessRefused(StatusError.DATA_RANGE)
        if not self._firmware.clear_turns(row):
            raise AccessRefused(StatusError.RESULT_FAIL)
        return b""

    def _back_up(self, row: int, params: bytes) -> bytes:
        table = self._tables[row]
        if not self.speaker.has_backup(row):
            raise AccessRefused(StatusError.INSTRUCTION)
        if params not in (_BACK_UP, _RESTORE):
            raise AccessRefused(StatusError.DATA_RANGE)
        if table.get("torque_enable"):
            raise AccessRefused(StatusError.RESULT_FAIL)
        if params == _BACK_UP:
            table.back_up()
            return b""
        table.restore()
        self._firmware.reboot(row)
        self._index()
        return b""

    def _store(self, row: int, writes: list[tuple[Register, int]]) -> None:
        self._firmware.store(row, writes)
        if any(register.name in _ROSTER_REGISTERS for register, _ in writes):
            self._index()

    def _index(self) -> None:
        self.speaker.faults.share_ids(self.audience.index())
