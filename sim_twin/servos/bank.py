"""Emulate all servos on one bus, as a device behind a line."""

from collections.abc import Sequence
from typing import Final

from drivers.dynamixel.codec import PacketParser
from sim_twin.servos.firmware import Firmware
from sim_twin.servos.profile import Floats
from sim_twin.servos.protocol import BusProtocol
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions

_PACKET_GAP_NS: Final = 1_500_000
"""A pause within an instruction packet after which a servo looks for a new header."""


class ServoBank:
    """Be the servos of one bus: bytes on the line on one side, shafts on the other.

    `advance` is called once per physics step. `step` only takes over the time, for a bus whose
    shafts nobody moves; a bus that is advanced does not need it.

    Raises:
        ValueError: there are no servos, or two of them share an id.
    """

    def __init__(
        self, servos: Sequence[EmulatedServoSpec], options: FirmwareOptions | None = None
    ) -> None:
        ids = [servo.id for servo in servos]
        if not ids or len(set(ids)) < len(ids):
            raise ValueError(f"servo ids: expected one or more, all different, got {ids}")
        options = options or FirmwareOptions()
        self._firmware = Firmware(servos, options)
        self._protocol = BusProtocol(self._firmware, options)
        self._parser = PacketParser()
        self._received_ns = 0
        self._replies: list[bytes] = []

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has put on the bus."""
        now_ns = self._firmware.now_ns
        if self._parser.pending_bytes and now_ns - self._received_ns > _PACKET_GAP_NS:
            self._parser.reset()
        self._received_ns = now_ns
        self._parser.feed(data)
        self._replies += [self._protocol.execute(packet) for packet in self._parser.packets()]

    def transmit(self) -> bytes:
        """Return and forget the replies."""
        replies = b"".join(self._replies)
        self._replies.clear()
        return replies

    def step(self, now_ns: int) -> None:
        """Take over the time; a bus watchdog that has run out trips."""
        self._firmware.set_time(now_ns)

    def advance(
        self,
        now_ns: int,
        position_rad: Floats,
        velocity_rad_s: Floats,
        torque_nm: Floats,
        supply_v: float = 12.0,
    ) -> Floats:
        """Tell what the shafts do; return each motor's duty, -1..1, until the next call.

        Arrays are in the order of the servos and in shaft coordinates; 0 rad is 2048 pulses. Duty
        is zero without torque. A supply below `FirmwareOptions.brownout_v` switches the servos off.
        """
        return self._firmware.advance(now_ns, position_rad, velocity_rad_s, torque_nm, supply_v)

    def register(self, servo_id: int, name: str) -> int:
        """Return a register's present value without using the bus."""
        table = self._firmware.registers.tables[self._protocol.rows[servo_id]]
        item = table.model.registers[name]
        self._firmware.refresh(item.address, item.size)
        return table.get(name)

    def silence(self, servo_id: int, *, silent: bool = True) -> None:
        """Cut a servo off the bus, as a broken cable does; its motor goes on."""
        change = self._protocol.silenced.add if silent else self._protocol.silenced.discard
        change(self._protocol.rows[servo_id])

    def corrupt_next(self, servo_id: int) -> None:
        """Spoil the CRC of this servo's next reply."""
        self._protocol.corrupted.add(self._protocol.rows[servo_id])

    def set_alert(self, servo_id: int, bits: int) -> None:
        """Raise hardware error bits, with what Shutdown makes of them."""
        self._firmware.raise_errors(self._protocol.rows[servo_id], bits)
