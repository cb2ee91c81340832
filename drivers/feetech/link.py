"""Carry out single transactions on a FEETECH bus: send, wait a bounded time, match the answer."""

from collections.abc import Sequence
from typing import Final

from drivers.clock import NS_PER_S
from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    OVERHEAD_BYTES,
    FeetechInstruction,
    FeetechPacket,
    FeetechParser,
    encode_packet,
)
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import FeetechRegister
from drivers.servo.errors import CorruptReply, ServoSilent
from drivers.servo.patience import ReplyPatience
from drivers.servo.wire import Wire

SETUP_PATIENCE: Final = ReplyPatience(margin_s=0.02, attempts=3)
"""For what is asked before or after motion, when a retry costs nothing."""


class FeetechLink(Wire):
    """Ask questions on the wire and tell their answers from what else is heard.

    A status always carries the servo's data, whatever errors it reports: no error is a refusal.
    """

    def detect_echo(self, servo_id: int, margin_s: float) -> None:
        """Find out by a request whether the adapter hears what it sends, and go on accordingly.

        A ping would not do: the answer of a servo whose supply is out of its limits is the same
        bytes as the question.

        Raises:
            LinkLost: the adapter is gone.
        """
        frame = encode_packet(servo_id, FeetechInstruction.READ, b"\x03\x02")
        reply_bytes = OVERHEAD_BYTES + 2
        margin_ns = round(margin_s * NS_PER_S)
        deadline_ns = self.ask(frame, len(frame) + reply_bytes, margin_ns)
        heard = self.receive_all(len(frame), deadline_ns)
        self.echoes = heard == frame
        if self.echoes:
            self.receive_all(reply_bytes, deadline_ns)

    def exchange(self, frame: bytes, reply_bytes: int, margin_s: float) -> tuple[bytes, int]:
        """Send a request; return what came of the expected bytes, and the deadline used.

        Raises:
            LinkLost: the adapter is gone.
        """
        deadline_ns = self.ask(frame, reply_bytes, round(margin_s * NS_PER_S))
        return self.receive_all(reply_bytes, deadline_ns), deadline_ns

    def request(
        self,
        servo: FeetechServo,
        instruction: FeetechInstruction,
        params: bytes = b"",
        *,
        answer_bytes: int = 0,
        patience: ReplyPatience = SETUP_PATIENCE,
    ) -> FeetechPacket:
        """Ask one servo and return its answer, whatever errors it reports.

        Raises:
            ServoSilent: no answer in any attempt.
            CorruptReply: only damaged answers.
            LinkLost: the adapter is gone.
        """
        frame = encode_packet(servo.id, instruction, params)
        damaged = 0
        for attempt in range(patience.attempts):
            self.counters.retries += bool(attempt)
            parser = FeetechParser()
            packet = self._ask_once(frame, servo.id, answer_bytes, patience.margin_s, parser)
            damaged += bool(parser.discarded_bytes)
            self.counters.crc_errors += parser.check_errors
            if packet is not None:
                return packet
            self.counters.timeouts += 1
        what = f"{instruction.name.lower().replace('_', ' ')} {servo}"
        if damaged:
            raise CorruptReply(
                f"{what}: {damaged} damaged answers in {patience.attempts} attempts; "
                "look for a second servo of this id, a loose cable, a wrong supply"
            )
        raise ServoSilent(
            f"{what}: no answer in {patience.attempts} attempts; check power, cable, id and speed"
        )

    def read_spans(
        self,
        servos: Sequence[FeetechServo],
        address: int,
        size: int,
        patience: ReplyPatience = SETUP_PATIENCE,
    ) -> dict[int, FeetechPacket]:
        """Return a span of the tables of many servos by id, without silent ones.

        Raises:
            LinkLost: the adapter is gone.
        """
        found: dict[int, FeetechPacket] = {}
        for attempt in range(patience.attempts):
            missing = [servo for servo in servos if servo.id not in found]
            if not missing:
                break
            self.counters.retries += bool(attempt)
            if all(servo.datasheet.has_sync_read for servo in missing):
                found |= self._sync_read([servo.id for servo in missing], address, size, patience)
            else:
                found |= self._read_singly(missing, address, size, patience)
        return found

    def read(self, servo: FeetechServo, name: str, patience: ReplyPatience = SETUP_PATIENCE) -> int:
        """Return a register's value.

        Raises:
            ValueError: the model has no such register.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        register = register_of(servo, name)
        params = bytes((register.address, register.size))
        packet = self.request(
            servo,
            FeetechInstruction.READ,
            params,
            answer_bytes=register.size,
            patience=patience,
        )
        return register.from_bytes(packet.params)

    def write(
        self,
        servo: FeetechServo,
        name: str,
        value: int,
        patience: ReplyPatience = SETUP_PATIENCE,
    ) -> None:
        """Write a register and wait for the servo's word; see `Settings` for what it must keep.

        Raises:
            ValueError: no such register, read-only, or the value does not fit its bytes.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        register = register_of(servo, name)
        params = bytes((register.address,)) + encode_value(servo, register, value)
        self.request(servo, FeetechInstruction.WRITE, params, patience=patience)

    def write_each(self, servos: Sequence[FeetechServo], name: str, values: Sequence[int]) -> None:
        """Write a register of many servos, each its own value; nobody answers.

        Raises:
            ValueError: no such register, read-only, or a value does not fit its bytes.
            LinkLost: the adapter is gone.
        """
        registers = [register_of(servo, name) for servo in servos]
        self.write_spans(
            servos,
            [
                (register.address, encode_value(servo, register, value))
                for servo, register, value in zip(servos, registers, values, strict=True)
            ],
        )

    def write_spans(
        self, servos: Sequence[FeetechServo], spans: Sequence[tuple[int, bytes]]
    ) -> None:
        """Write as many bytes at one address of many servos at one instant; nobody answers.

        Raises:
            LinkLost: the adapter is gone.
        """
        address, data = spans[0]
        params = bytes((address, len(data)))
        for servo, (_, each) in zip(servos, spans, strict=True):
            params += bytes((servo.id,)) + each
        self.send(encode_packet(FEETECH_BROADCAST_ID, FeetechInstruction.SYNC_WRITE, params))

    def _sync_read(
        self, ids: Sequence[int], address: int, size: int, patience: ReplyPatience
    ) -> dict[int, FeetechPacket]:
        frame = sync_read_frame(ids, address, size)
        data, deadline_ns = self.exchange(
            frame, len(ids) * (size + OVERHEAD_BYTES), patience.margin_s
        )
        return self.collect(ids, size, data, deadline_ns)

    def collect(
        self, ids: Sequence[int], size: int, data: bytes, deadline_ns: int
    ) -> dict[int, FeetechPacket]:
        """Frame a reply anew, and wait for what is missing of it until the deadline.

        Raises:
            LinkLost: the adapter is gone.
        """
        parser = FeetechParser()
        found: dict[int, FeetechPacket] = {}

        def take(packets: Sequence[FeetechPacket]) -> None:
            # a late answer of an earlier cycle comes first, so the last one wins
            found.update({p.servo_id: p for p in packets if _answers(p, ids, size)})

        take(parser.feed(data))
        while len(found) < len(ids):
            more = self.receive(len(ids) * (size + OVERHEAD_BYTES), deadline_ns)
            if not more:
                break
            take(parser.feed(more))
        take(parser.salvage())
        self.counters.crc_errors += parser.check_errors
        self.counters.timeouts += len(ids) - len(found)
        return found

    def _read_singly(
        self, servos: Sequence[FeetechServo], address: int, size: int, patience: ReplyPatience
    ) -> dict[int, FeetechPacket]:
        once = ReplyPatience(margin_s=patience.margin_s, attempts=1)
        found = {}
        for servo in servos:
            try:
                found[servo.id] = self.request(
                    servo,
                    FeetechInstruction.READ,
                    bytes((address, size)),
                    answer_bytes=size,
                    patience=once,
                )
            except (ServoSilent, CorruptReply):
                continue
        return found

    def _ask_once(
        self,
        frame: bytes,
        servo_id: int,
        answer_bytes: int,
        margin_s: float,
        parser: FeetechParser,
    ) -> FeetechPacket | None:
        reply_bytes = answer_bytes + OVERHEAD_BYTES
        data, deadline_ns = self.exchange(frame, reply_bytes, margin_s)
        packets = parser.feed(data)
        while (packet := _answer(packets, servo_id, answer_bytes)) is None:
            data = self.receive(reply_bytes, deadline_ns)
            if not data:
                return _answer(parser.salvage(), servo_id, answer_bytes)
            packets = parser.feed(data)
        return packet


def sync_read_frame(ids: Sequence[int], address: int, size: int) -> bytes:
    """Return the request for the same span of many servos."""
    params = bytes((address, size, *ids))
    return encode_packet(FEETECH_BROADCAST_ID, FeetechInstruction.SYNC_READ, params)


def register_of(servo: FeetechServo, name: str) -> FeetechRegister:
    """Return a servo's register.

    Raises:
        ValueError: the model has no register of this name.
    """
    registers = servo.datasheet.registers
    if name not in registers:
        raise ValueError(f"{servo}: no register {name!r}; it has {', '.join(registers)}")
    return registers[name]


def encode_value(servo: FeetechServo, register: FeetechRegister, value: int) -> bytes:
    """Return a value as a register holds it.

    Raises:
        ValueError: the register is read-only, or the value does not fit it.
    """
    if register.access == "r":
        raise ValueError(f"{servo}: register {register.name} is read-only")
    try:
        return register.to_bytes(value)
    except OverflowError:
        raise ValueError(
            f"{servo}: {register.name} must lie in {register.minimum}..{register.maximum}, "
            f"got {value}"
        ) from None


def value_in(servo: FeetechServo, span: bytes, start: int, name: str) -> int:
    """Return a register's value out of a span that starts at address `start`."""
    register = register_of(servo, name)
    first = register.address - start
    return register.from_bytes(span[first : first + register.size])


def _answers(packet: FeetechPacket, ids: Sequence[int], size: int) -> bool:
    return packet.servo_id in ids and len(packet.params) == size


def _answer(packets: list[FeetechPacket], servo_id: int, size: int) -> FeetechPacket | None:
    return next((packet for packet in packets if _answers(packet, (servo_id,), size)), None)
