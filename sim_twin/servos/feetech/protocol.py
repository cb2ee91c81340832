"""Carry out FEETECH instructions on the servos of one bus and collect their replies.

Only servos that are addressed, powered, booted and not cut off take part. There is no error for a
request: what a servo does not know, or whose check sum is wrong, it does not answer. Servos behind
a missing one answer a sync read at once. Servos that were given one id all obey and answer at
once, which is heard as garbage.
"""

from collections.abc import Callable
from typing import Final

from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    FEETECH_MAX_ID,
    FeetechInstruction,
    FeetechPacket,
    encode_packet,
)
from drivers.feetech.table import CENTRE_STEP, FEETECH_BAUD_RATES
from sim_twin.servos.feetech.firmware import FeetechFirmware
from sim_twin.servos.feetech.memory import SENSED
from sim_twin.servos.protocol.audience import BusAudience
from sim_twin.servos.protocol.timing import Reply
from sim_twin.servos.protocol.wire_faults import WireFaults

_NS_PER_RETURN_DELAY: Final = 2_000
_ANSWERED_AT_LEVEL_0: Final = (FeetechInstruction.PING, FeetechInstruction.READ)
_SCS_KNOWS: Final = frozenset(
    {
        FeetechInstruction.PING,
        FeetechInstruction.READ,
        FeetechInstruction.WRITE,
        FeetechInstruction.REG_WRITE,
        FeetechInstruction.ACTION,
        FeetechInstruction.REBOOT,
    }
)


class FeetechProtocol:
    """Take packets, give replies."""

    def __init__(self, firmware: FeetechFirmware) -> None:
        self._firmware = firmware
        self._memory = memory = firmware.memory
        self.faults = WireFaults(FEETECH_MAX_ID)
        self.audience = BusAudience(memory.get, len(memory), firmware.answers, FEETECH_BAUD_RATES)
        firmware.on_roster = self._index
        self._actions: dict[int, Callable[[int, bytes], bytes | None]] = {
            FeetechInstruction.PING: self._ping,
            FeetechInstruction.READ: self._read,
            FeetechInstruction.WRITE: self._write,
            FeetechInstruction.REG_WRITE: self._reg_write,
            FeetechInstruction.ACTION: self._action,
            FeetechInstruction.RESTORE: self._restore,
            FeetechInstruction.REBOOT: self._reboot,
            FeetechInstruction.BACKUP: self._back_up,
            FeetechInstruction.RESET_STATE: self._reset_state,
            FeetechInstruction.CALIBRATE_POSITION: self._calibrate,
        }

    def execute(self, packet: FeetechPacket) -> list[Reply]:
        """Return what the servos answer to a packet."""
        if packet.code == FeetechInstruction.SYNC_READ:
            return self._sync_read(packet)
        if packet.code == FeetechInstruction.SYNC_WRITE:
            self._sync_write(packet)
            return []
        if packet.code not in self._actions:
            return []
        if packet.servo_id == FEETECH_BROADCAST_ID:
            return self._broadcast(packet)
        replies: list[Reply] = []
        for row in self._listening(self.audience.named(packet.servo_id)):
            reply = self._single(row, packet)
            replies = replies or reply
        return replies

    def freeze(self, row: int) -> None:
        """Let a servo show for ever what it senses now."""
        shown = self._firmware.read(row, SENSED[0].start, SENSED[-1].stop - SENSED[0].start)
        self.faults.frozen[row] = shown or b""

    # Who is meant, and whether they answer

    def _listening(self, rows: list[int]) -> list[int]:
        return [row for row in rows if self.audience.listens(row)]

    def _broadcast(self, packet: FeetechPacket) -> list[Reply]:
        """Let all servos obey; only STS and SMS answer a ping, those of one id at once."""
        replies: dict[int, list[Reply]] = {}
        for row in self._listening(self.audience.everyone()):
            servo_id = self._memory.get(row, "id")
            reply = self._single(row, packet)
            if packet.code == FeetechInstruction.PING and self._memory.sheets[row].has_sync_read:
                replies[servo_id] = replies.get(servo_id) or reply
        return [reply for each in replies.values() for reply in each]

    def _single(self, row: int, packet: FeetechPacket) -> list[Reply]:
        if packet.code not in _SCS_KNOWS and not self._memory.sheets[row].has_sync_read:
            return []
        # An answer comes from the servo as it was when it was asked.
        servo_id, delay_ns = self._memory.get(row, "id"), self._return_delay_ns(row)
        level = self._memory.get(row, "status_return_level")
        data = self._actions[packet.code](row, packet.params)
        if data is None or not (level or packet.code in _ANSWERED_AT_LEVEL_0):
            return []
        return self._say(row, servo_id, data, delay_ns)

    def _say(self, row: int, servo_id: int, data: bytes, delay_ns: int) -> list[Reply]:
        faults = self.faults
        shown_id = faults.aliases.get(row, servo_id)
        packet = encode_packet(shown_id, self._firmware.error_byte(row), data)
        if faults.active:
            packet = faults.spoil(row, packet)
        return [Reply(packet, delay_ns, faults.late_ns(row))] if packet else []

    def _return_delay_ns(self, row: int) -> int:
        return self._memory.get(row, "return_delay_time") * _NS_PER_RETURN_DELAY

    def _index(self) -> None:
        self.faults.share_ids(self.audience.index())

    # Groups

    def _sync_read(self, packet: FeetechPacket) -> list[Reply]:
        if packet.servo_id != FEETECH_BROADCAST_ID or len(packet.params) < 2:
            return []
        head, ids = packet.params[:2], packet.params[2:]
        replies: list[Reply] = []
        for servo_id in ids:
            rows = self._listening(self.audience.named(servo_id))
            if not rows or not self._memory.sheets[rows[0]].has_sync_read:
                continue
            data = self._read(rows[0], head)
            if data is not None:
                replies += self._say(rows[0], servo_id, data, self._return_delay_ns(rows[0]))
        return replies

    def _sync_write(self, packet: FeetechPacket) -> None:
        if packet.servo_id != FEETECH_BROADCAST_ID or len(packet.params) < 2:
            return
        address, length = packet.params[:2]
        for start in range(2, len(packet.params) - length, length + 1):
            servo_id, data = packet.params[start], packet.params[start + 1 : start + 1 + length]
            for row in self._listening(self.audience.named(servo_id)):
                self._firmware.store(row, address, data)

    # What one servo does; None is no answer

    def _ping(self, _row: int, _params: bytes) -> bytes:
        return b""

    def _read(self, row: int, params: bytes) -> bytes | None:
        if len(params) != 2:
            return None
        address, count = params
        data = self._firmware.read(row, address, count)
        frozen = self.faults.frozen.get(row)
        if data is None or not frozen:
            return data
        shown = bytearray(data)
        for span in SENSED:
            for where in range(max(address, span.start), min(address + count, span.stop)):
                shown[where - address] = frozen[where - SENSED[0].start]
        return bytes(shown)

    def _write(self, row: int, params: bytes) -> bytes | None:
        if len(params) < 2:
            return None
        self._firmware.store(row, params[0], params[1:])
        return b""

    def _reg_write(self, row: int, params: bytes) -> bytes | None:
        if len(params) < 2:
            return None
        self._firmware.hold(row, params[0], params[1:])
        return b""

    def _action(self, row: int, _params: bytes) -> bytes:
        self._firmware.release(row)
        return b""

    def _restore(self, row: int, _params: bytes) -> bytes:
        self._firmware.restore(row)
        return b""

    def _reboot(self, row: int, _params: bytes) -> None:
        self._firmware.reboot(row)

    def _back_up(self, row: int, _params: bytes) -> bytes:
        self._memory.back_up(row)
        return b""

    def _reset_state(self, row: int, _params: bytes) -> bytes:
        self._firmware.reset_state(row)
        return b""

    def _calibrate(self, row: int, params: bytes) -> bytes:
        step = int.from_bytes(params, "little") if len(params) == 2 else CENTRE_STEP
        self._firmware.calibrate(row, step)
        return b""
