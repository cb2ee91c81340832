"""Read control tables for the host and put the answers on the wire, with the faults in force."""

from collections.abc import Callable, Iterable
from typing import Final

from drivers.dynamixel.tables.control_table import Register
from drivers.dynamixel.wire.codec import ALERT, encode_status
from sim_twin.servos.firmware.firmware import Firmware
from sim_twin.servos.protocol.registers import SENSED, AccessRefused
from sim_twin.servos.protocol.timing import Reply
from sim_twin.servos.protocol.wire_faults import WireFaults

Store = Callable[[int, list[tuple[Register, int]]], None]
"""Carry out a write that was checked: row, registers and values."""

_NS_PER_RETURN_DELAY: Final = 2_000


class ServoSpeaker:
    """Say what servos have to say."""

    def __init__(self, firmware: Firmware) -> None:
        self.faults = WireFaults()
        self._firmware = firmware
        self._tables = firmware.registers.tables
        self.some_lack_fast = not all(map(self.has_fast_reads, range(len(self._tables))))

    def has_fast_reads(self, row: int) -> bool:
        """Return whether a servo's model and firmware know fast sync and bulk reads."""
        table = self._tables[row]
        return table.model.has_fast_sync(table.get("firmware_version"))

    def has_backup(self, row: int) -> bool:
        """Return whether a servo knows the control table backup, which came with fast reads."""
        return self.has_fast_reads(row) and "backup_ready" in self._tables[row].model.registers

    def shown_id(self, row: int) -> int:
        """Return the id under which a servo answers."""
        return self.faults.aliases.get(row, self._tables[row].get("id"))

    def return_delay_ns(self, row: int) -> int:
        """Return how long a servo waits before it answers."""
        return self._tables[row].get("return_delay_time") * _NS_PER_RETURN_DELAY

    def alert(self, row: int) -> int:
        """Return the alert bit of a servo."""
        return ALERT if self._tables[row].get("hardware_error_status") else 0

    def refresh(self, rows: Iterable[int], address: int, length: int) -> None:
        """Bring present values up to date that a read of these servos will see."""
        for start, size in self._firmware.registers.sources(rows, address, length):
            self._firmware.refresh(start, size)

    def read(self, row: int, address: int, length: int) -> tuple[int, bytes]:
        """Return error byte and data of a read whose values are up to date."""
        try:
            data = self._tables[row].read(address, length, self.faults.frozen.get(row))
        except AccessRefused as refusal:
            return self.alert(row) | refusal.number, b""
        return self.alert(row), data

    def freeze(self, row: int) -> None:
        """Let a servo show for ever what it senses now."""
        self._firmware.refresh(SENSED.start, len(SENSED))
        self.faults.frozen[row] = self._tables[row].sensed()

    def answer(self, row: int, error: int, data: bytes, servo_id: int | None = None) -> list[Reply]:
        """Return a status packet as it goes on the wire; none where it is lost.

        `servo_id` is the id from before the instruction, where that may have changed it.
        """
        faults = self.faults
        if servo_id is None or row in faults.aliases:
            servo_id = self.shown_id(row)
        packet = encode_status(servo_id, error, data)
        if faults.active:
            packet = faults.spoil(row, packet)
        if not packet:
            return []
        return [Reply(packet, self.return_delay_ns(row), faults.late_ns(row))]
