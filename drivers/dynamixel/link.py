"""Carry out single transactions on a servo bus: send, wait a bounded time, match the answer."""

from dataclasses import dataclass
from typing import Final

from drivers.base import BurstTransport, ByteTransport, CheckedTransport, TunableTransport
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
PING_REPLY_BYTES: Final = STATUS_OVERHEAD_BYTES + 3
_STALE_BYTES: Final = 4096
_STALE_READS: Final = 16
_ECHO_PATIENCE_NS: Final = 5_000_000
_STALL_RATIO: Final = 0.6
"""How much of the margin the next part of a chained reply may be late."""
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
        self._burst = transport if isinstance(transport, BurstTransport) else None
        self.baud = baud
        self.ns_per_byte = _BITS_PER_BYTE * NS_PER_S // baud
        self._sent_ns = 0
        """When the last byte handed over has left, unless an answer shows that it has."""
        self._answered = True
        self._lateness_ns: int | None = None
        self.echoes = False
        """The adapter hears itself; what comes back of it is taken off the line."""
        self._watchful = _WATCHFUL_SENDS
        self._lost: LinkLost | None = None

    def now_ns(self) -> int:
        """Return the time of the link's clock."""
        return self._clock.now_ns()

    def close(self) -> None:
        """Release the transport."""
        self._transport.close()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed, where the transport can; see `other_bauds`.

        Raises:
            LinkLost: the adapter is gone.
        """
        if isinstance(self._transport, TunableTransport):
            self._transport.set_baud(baud)
            self.baud = baud
            self.ns_per_byte = _BITS_PER_BYTE * NS_PER_S // baud

    @property
    def other_bauds(self) -> tuple[int, ...]:
        """Return the speeds to which the transport can be set, but for the present one."""
        if not isinstance(self._transport, TunableTransport):
            return ()
        return tuple(baud for baud in self._transport.bauds if baud != self.baud)

    @property
    def adapter_fault(self) -> str:
        """Return what slows the adapter down and how to mend it, or ""."""
        transport = self._transport
        return transport.adapter_fault() if isinstance(transport, CheckedTransport) else ""

    def detect_echo(self, servo_id: int, margin_s: float) -> None:
        """Find out by a ping whether the adapter hears what it sends, and go on accordingly.

        Raises:
            LinkLost: the adapter is gone.
        """
        frame = encode_instruction(servo_id, Instruction.PING)
        deadline_ns = self.ask(frame, len(frame) + PING_REPLY_BYTES, margin_s)
        heard = self.receive_all(len(frame), deadline_ns)
        self.echoes = heard == frame
        rest = PING_REPLY_BYTES if self.echoes else PING_REPLY_BYTES - len(heard)
        if heard:
            self.receive_all(rest, deadline_ns)

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
        now_ns = self.last_sent_ns = self._clock.now_ns()
        start_ns = now_ns if self._answered else max(now_ns, self._sent_ns)
        self._sent_ns = start_ns + len(frame) * self.ns_per_byte
        self._answered = False
        if self.echoes:
            self._hear_echo(frame)

    def exchange(self, frame: bytes, reply_bytes: int, margin_s: float) -> tuple[bytes, int]:
        """Send a request and return what came of the expected bytes, and the deadline used.

        Raises:
            LinkLost: the adapter is gone.
        """
        deadline_ns = self.ask(frame, reply_bytes, margin_s)
        return self.receive_all(reply_bytes, deadline_ns), deadline_ns

    def ask(self, frame: bytes, reply_bytes: int, margin_s: float) -> int:
        """Send a request and return until when its answer is waited for.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.send(frame)
        return self._sent_ns + reply_bytes * self.ns_per_byte + round(margin_s * NS_PER_S)

    def wire_ns(self, read: SyncRead, margin_s: float) -> int:
        """Return how long a sync read takes at most."""
        wire_bytes = len(read.request) + read.reply_bytes
        return wire_bytes * self.ns_per_byte + round(margin_s * NS_PER_S)

    def receive_all(self, count: int, deadline_ns: int) -> bytes:
        """Return `count` bytes, or what of them came by the deadline.

        Raises:
            LinkLost: the adapter is gone.
        """
        if self._burst is None:
            data = self._receive_in_parts(count, deadline_ns)
        else:
            data = self._receive_burst(self._burst, count, deadline_ns)
        self._answered = len(data) == count
        return data

    def _receive_burst(self, transport: BurstTransport, count: int, deadline_ns: int) -> bytes:
        try:
            data = transport.read_burst(count, deadline_ns)
        except LinkLost as error:
            raise self._note_loss(error) from error
        if len(data) < count:
            self._watchful = _WATCHFUL_SENDS
        return data

    def receive_chained(self, read: SyncRead, deadline_ns: int, margin_s: float) -> bytes:
        """Return what came of a fast sync read's reply; give up early where it has stopped.

        The reply is one packet to which each servo adds its part. When the next part does not
        begin in time, nothing more will come. What is in time must be learned first: some adapters
        and UARTs hold back a reply until it is over.

        Raises:
            LinkLost: the adapter is gone.
        """
        count = read.reply_bytes
        data = self.receive(count, self._stall_ns(read, 0, deadline_ns, margin_s))
        late_ns = self._clock.now_ns() - self._part_ns(read, 0)
        while data and len(data) < count:
            limit_ns = self._stall_ns(read, len(data), deadline_ns, margin_s)
            more = self.receive_all(count - len(data), limit_ns)
            if not more:
                return data
            data += more
        self._answered = bool(data)
        if data:
            self._lateness_ns = max(self._lateness_ns or 0, late_ns)
        return data

    def _part_ns(self, read: SyncRead, arrived: int) -> int:
        """Return when the next part of a chained reply is over on the wire."""
        wire_bytes = arrived + STATUS_OVERHEAD_BYTES + read.size
        return self._sent_ns + wire_bytes * self.ns_per_byte

    def _stall_ns(self, read: SyncRead, arrived: int, deadline_ns: int, margin_s: float) -> int:
        """Return when to take a chained reply for stopped."""
        if self._lateness_ns is None:
            return deadline_ns
        patience_ns = max(round(margin_s * _STALL_RATIO * NS_PER_S), 2 * self._lateness_ns)
        return min(deadline_ns, self._part_ns(read, arrived) + patience_ns)

    def _receive_in_parts(self, count: int, deadline_ns: int) -> bytes:
        data = self.receive(count, deadline_ns)
        while len(data) < count:
            more = self.receive(count - len(data), deadline_ns)
            if not more:
                break
            data += more
        return data

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

    def _hear_echo(self, frame: bytes) -> None:
        wire_ns = len(frame) * self.ns_per_byte
        echo = self.receive_all(len(frame), self._clock.now_ns() + wire_ns + _ECHO_PATIENCE_NS)
        if echo != frame:  # two talked at once: what follows is framed anew
            self.counters.discarded_bytes += len(echo)
            self._watchful = _WATCHFUL_SENDS

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
