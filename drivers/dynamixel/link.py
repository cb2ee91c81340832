"""Carry out single transactions on a servo bus: send, wait a bounded time, match the answer."""

from dataclasses import dataclass
from typing import Final

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.dynamixel.codec import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    Packet,
    PacketParser,
    encode_instruction,
)
from drivers.dynamixel.counters import BusCounters
from drivers.dynamixel.errors import REJECTIONS, CorruptReply, Rejected, ServoSilent
from drivers.dynamixel.sync_read import STATUS_OVERHEAD_BYTES, Entry, ReplyCollector, SyncRead
from drivers.errors import LinkLost

_BITS_PER_BYTE: Final = 10
_STALE_BYTES: Final = 4096
_STALE_READS: Final = 16
_WATCHFUL_SENDS: Final = 8
"""How many transactions after a missing answer look for it before they ask anew."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """Say how long beyond the wire time to wait for an answer, and how often to ask."""

    margin_s: float
    attempts: int


class Link:
    """Own the transport; every byte to and from the servos passes here.

    Once the transport is lost, every call raises LinkLost at once, without touching it again.
    """

    def __init__(
        self, transport: ByteTransport, clock: Clock, baud: int, counters: BusCounters
    ) -> None:
        self.counters = counters
        self.last_sent_ns = clock.now_ns()
        self._transport = transport
        self._clock = clock
        self._ns_per_byte = _BITS_PER_BYTE * NS_PER_S // baud
        self._watchful = _WATCHFUL_SENDS
        self._lost: LinkLost | None = None

    def now_ns(self) -> int:
        """Return the time of the link's clock."""
        return self._clock.now_ns()

    def close(self) -> None:
        """Release the transport."""
        self._transport.close()

    def send(self, frame: bytes) -> None:
        """Send a packet that nobody answers.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._lost is not None:
            raise LinkLost(f"{self._lost} (lost before)")
        if self._watchful:
            self._drop_stale_input()
        try:
            self._transport.write(frame)
        except LinkLost as error:
            raise self._note_loss(error) from error
        self.last_sent_ns = self._clock.now_ns()

    def exchange(self, frame: bytes, reply_bytes: int, margin_s: float) -> tuple[bytes, int]:
        """Send a request and return what came of the expected bytes, and the deadline used.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.send(frame)
        deadline_ns = self._deadline_ns(len(frame) + reply_bytes, margin_s)
        data = self.receive(reply_bytes, deadline_ns)
        while len(data) < reply_bytes:
            more = self.receive(reply_bytes - len(data), deadline_ns)
            if not more:
                break
            data += more
        return data, deadline_ns

    def receive(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return what arrives by the deadline; nothing means that later bytes would be stale.

        Raises:
            LinkLost: the adapter is gone.
        """
        try:
            data = self._transport.read(max_bytes, deadline_ns)
        except LinkLost as error:
            raise self._note_loss(error) from error
        if not data:
            self._watchful = _WATCHFUL_SENDS
        return data

    def collect(self, read: SyncRead, data: bytes, deadline_ns: int) -> dict[int, Entry]:
        """Frame a reply anew and wait for what is missing of it until the deadline.

        Raises:
            LinkLost: the adapter is gone.
        """
        collector = ReplyCollector(read)
        collector.feed(data)
        while not collector.complete:
            more = self.receive(read.reply_bytes, deadline_ns)
            if not more:
                break
            collector.feed(more)
        entries = collector.finish()
        self.counters.crc_errors += collector.crc_errors
        self.counters.timeouts += len(read.ids) - len(entries)
        return entries

    def sync_read(self, read: SyncRead, patience: Patience) -> dict[int, Entry]:
        """Return what the servos answer to a sync read, by id; silent ones are left out.

        Raises:
            LinkLost: the adapter is gone.
        """
        entries: dict[int, Entry] = {}
        for attempt in range(patience.attempts):
            self.counters.retries += bool(attempt)
            data, deadline_ns = self.exchange(read.request, read.reply_bytes, patience.margin_s)
            entries |= self.collect(read, data, deadline_ns)
            if len(entries) == len(read.ids):
                break
        return entries

    def broadcast(self, instruction: Instruction, params: bytes) -> None:
        """Send an instruction to all servos.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.send(encode_instruction(BROADCAST_ID, instruction, params))

    def request(
        self,
        servo_id: int,
        instruction: Instruction,
        params: bytes,
        *,
        answer_bytes: int,
        patience: Patience,
        name: str,
    ) -> Packet:
        """Ask one servo and return its answer; an alert bit is no failure.

        `name` says in error messages whom and what was asked.

        Raises:
            ServoSilent: no answer in any attempt.
            CorruptReply: only damaged answers.
            Rejected: the servo refused.
            LinkLost: the adapter is gone.
        """
        frame = encode_instruction(servo_id, instruction, params)
        crc_errors = 0
        for attempt in range(patience.attempts):
            self.counters.retries += bool(attempt)
            parser = PacketParser()
            packet = self._ask_once(frame, servo_id, answer_bytes, patience.margin_s, parser)
            crc_errors += parser.crc_errors
            self.counters.crc_errors += parser.crc_errors
            if packet is not None:
                _raise_rejection(packet, name)
                return packet
            self.counters.timeouts += 1
        raise _no_answer(name, patience, crc_errors)

    def _ask_once(
        self, frame: bytes, servo_id: int, answer_bytes: int, margin_s: float, parser: PacketParser
    ) -> Packet | None:
        reply_bytes = answer_bytes + STATUS_OVERHEAD_BYTES
        data, deadline_ns = self.exchange(frame, reply_bytes, margin_s)
        parser.feed(data)
        packets = parser.packets()
        while (packet := _answer(packets, servo_id, answer_bytes)) is None:
            data = self.receive(reply_bytes, deadline_ns)
            if not data:
                return _answer(parser.salvage(), servo_id, answer_bytes)
            parser.feed(data)
            packets = parser.packets()
        return packet

    def _deadline_ns(self, wire_bytes: int, margin_s: float) -> int:
        return self._clock.now_ns() + wire_bytes * self._ns_per_byte + round(margin_s * NS_PER_S)

    def _drop_stale_input(self) -> None:
        """Forget answers that came too late, or the next reply would be read one cycle old."""
        self._watchful -= 1
        try:
            for _ in range(_STALE_READS):
                stale = self._transport.read(_STALE_BYTES, self._clock.now_ns())
                if not stale:
                    return
                self._watchful = _WATCHFUL_SENDS
                self.counters.late += 1
                self.counters.discarded_bytes += len(stale)
        except LinkLost as error:
            raise self._note_loss(error) from error

    def _note_loss(self, error: LinkLost) -> LinkLost:
        self.counters.link_lost += 1
        self._lost = error
        return error


def _answer(packets: list[Packet], servo_id: int, answer_bytes: int) -> Packet | None:
    """Return the packet that answers; another id or length belongs to an earlier question."""
    for packet in packets:
        refused = (packet.error or 0) & ~ALERT
        if (
            packet.instruction == Instruction.STATUS
            and packet.servo_id == servo_id
            and (refused or len(packet.params) == answer_bytes)
        ):
            return packet
    return None


def _raise_rejection(packet: Packet, name: str) -> None:
    number = (packet.error or 0) & ~ALERT
    if number:
        kind, remedy = REJECTIONS.get(number, (Rejected, "see the servo's manual"))
        raise kind(f"{name}: refused with error {number}; {remedy}")


def _no_answer(name: str, patience: Patience, crc_errors: int) -> CorruptReply | ServoSilent:
    if crc_errors:
        return CorruptReply(
            f"{name}: {crc_errors} damaged answers in {patience.attempts} attempts; "
            "check cable, termination, and that no two servos share the id"
        )
    return ServoSilent(
        f"{name}: no answer in {patience.attempts} attempts; "
        "check its power, cable, id and baud rate"
    )
