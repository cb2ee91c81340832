"""Read and write registers by name, one servo at a time or many at once."""

from collections.abc import Mapping, Sequence
from typing import Final

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import Register
from drivers.dynamixel.wire.codec import Instruction
from drivers.dynamixel.wire.link import PacketLink
from drivers.dynamixel.wire.sync_read import SyncRead
from drivers.servo.patience import ReplyPatience

SETUP: Final = ReplyPatience(margin_s=0.02, attempts=3)
"""For what is asked before or after motion, when a retry costs nothing."""

_PING_ANSWER_BYTES: Final = 3


def register_of(servo: ServoSpec, name: str) -> Register:
    """Return a servo's register.

    Raises:
        ValueError: the model has no register of this name.
    """
    try:
        return servo.model.registers[name]
    except KeyError:
        raise ValueError(
            f"{servo}: no register {name!r}; it has {', '.join(servo.model.registers)}"
        ) from None


class Registers:
    """Turn register names into transactions; an alert bit is no failure of a transaction.

    All methods that wait for an answer raise ServoSilent, CorruptReply or Rejected (a class per
    reason) for the servo, and LinkLost when the adapter is gone.
    """

    def __init__(self, link: PacketLink) -> None:
        self._link = link

    @property
    def link(self) -> PacketLink:
        """Return what carries the transactions."""
        return self._link

    def ping(self, servo: ServoSpec, patience: ReplyPatience = SETUP) -> tuple[int, int]:
        """Return a servo's model number and firmware version.

        Raises:
            ServoSilent: no answer.
        """
        packet = self._link.request(
            servo.id,
            Instruction.PING,
            b"",
            answer_bytes=_PING_ANSWER_BYTES,
            patience=patience,
            name=f"ping {servo}",
        )
        return int.from_bytes(packet.params[:2], "little"), packet.params[2]

    def read(self, servo: ServoSpec, name: str, patience: ReplyPatience = SETUP) -> int:
        """Return a register's value.

        Raises:
            ValueError: the model has no such register.
            ServoSilent: no answer.
        """
        register = register_of(servo, name)
        return register.from_bytes(self.read_span(servo, register.address, register.size, patience))

    def read_span(
        self, servo: ServoSpec, address: int, size: int, patience: ReplyPatience = SETUP
    ) -> bytes:
        """Return the bytes of neighbouring registers, read at one instant.

        Raises:
            ServoSilent: no answer.
        """
        packet = self._link.request(
            servo.id,
            Instruction.READ,
            address.to_bytes(2, "little") + size.to_bytes(2, "little"),
            answer_bytes=size,
            patience=patience,
            name=f"read {servo} address {address}, {size} bytes",
        )
        return packet.params

    def write(
        self, servo: ServoSpec, name: str, value: int, patience: ReplyPatience = SETUP
    ) -> None:
        """Write a register and wait for the servo's consent.

        Raises:
            ValueError: no such register, not writable, or the value does not fit its bytes.
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
        """
        register = register_of(servo, name)
        self._link.request(
            servo.id,
            Instruction.WRITE,
            register.address.to_bytes(2, "little") + _encode(servo, register, value),
            answer_bytes=0,
            patience=patience,
            name=f"write {servo} {name} = {value}",
        )

    def write_span(
        self, servo: ServoSpec, address: int, data: bytes, patience: ReplyPatience = SETUP
    ) -> None:
        """Write neighbouring bytes at one instant and wait for the servo's consent.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
        """
        self._link.request(
            servo.id,
            Instruction.WRITE,
            address.to_bytes(2, "little") + data,
            answer_bytes=0,
            patience=patience,
            name=f"write {servo} address {address}, {len(data)} bytes",
        )

    def read_many(
        self, name: str, servos: Sequence[ServoSpec], patience: ReplyPatience = SETUP
    ) -> dict[int, int]:
        """Return a register of many servos by id; silent servos are left out.

        Raises:
            ValueError: a model has no such register.
            LinkLost: the adapter is gone.
        """
        register = _common_register(servos, name)
        spans = self.read_span_many(servos, register.address, register.size, patience)
        return {servo_id: register.from_bytes(span) for servo_id, span in spans.items()}

    def read_span_many(
        self, servos: Sequence[ServoSpec], address: int, size: int, patience: ReplyPatience = SETUP
    ) -> dict[int, bytes]:
        """Return the bytes of neighbouring registers of many servos by id, without silent ones.

        Raises:
            LinkLost: the adapter is gone.
        """
        read = SyncRead([servo.id for servo in servos], address, size, fast=False)
        entries = self._link.sync_read(read, patience)
        return {servo_id: entry.data for servo_id, entry in entries.items()}

    def write_many(self, name: str, servos: Sequence[ServoSpec], value: int) -> None:
        """Write one value to a register of many servos at one instant; nobody answers.

        Raises:
            ValueError: no such register, not writable, or the value does not fit its bytes.
            LinkLost: the adapter is gone.
        """
        self.write_each(name, servos, {servo.id: value for servo in servos})

    def write_each(self, name: str, servos: Sequence[ServoSpec], values: Mapping[int, int]) -> None:
        """Write a register of many servos, each its own value by id; nobody answers.

        Raises:
            ValueError: no such register, not writable, or a value does not fit its bytes.
            LinkLost: the adapter is gone.
        """
        register = _common_register(servos, name)
        params = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        for servo in servos:
            params += bytes((servo.id,)) + _encode(servo, register, values[servo.id])
        self._link.broadcast(Instruction.SYNC_WRITE, params)

    def reboot(self, servo: ServoSpec) -> None:
        """Restart a servo's firmware, the only way out of a shutdown.

        Raises:
            ServoSilent: no answer.
        """
        self._link.request(
            servo.id,
            Instruction.REBOOT,
            b"",
            answer_bytes=0,
            patience=ReplyPatience(margin_s=SETUP.margin_s, attempts=1),
            name=f"reboot {servo}",
        )


def decode(servo: ServoSpec, image: bytes, start: int, name: str) -> int:
    """Return a register's value out of a span that starts at address `start`."""
    register = register_of(servo, name)
    first = register.address - start
    return register.from_bytes(image[first : first + register.size])


def _common_register(servos: Sequence[ServoSpec], name: str) -> Register:
    """Return the register by which all of the servos' models know a name."""
    register = register_of(servos[0], name)
    for servo in servos:
        other = register_of(servo, name)
        if (other.address, other.size) != (register.address, register.size):
            raise ValueError(f"{servo}: {name} is not where {servos[0]} has it; write them singly")
    return register


def _encode(servo: ServoSpec, register: Register, value: int) -> bytes:
    if not register.writable:
        raise ValueError(f"{servo}: register {register.name} is read-only")
    try:
        return register.to_bytes(value)
    except OverflowError:
        raise ValueError(
            f"{servo}: {register.name} must fit in {register.size} bytes and lie in "
            f"{register.minimum}..{register.maximum}, got {value}"
        ) from None
