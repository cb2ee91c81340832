"""Carry out single transactions on a servo bus: send, wait a bounded time, match the answer."""

from typing import Final

from drivers.clock import NS_PER_S
from drivers.dynamixel.errors import REJECTIONS
from drivers.dynamixel.wire.chained import ChainedWire
from drivers.dynamixel.wire.codec import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    Packet,
    PacketParser,
    encode_instruction,
)
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES, Entry, ReplyCollector, SyncRead
from drivers.servo.errors import CorruptReply, Rejected, ServoSilent
from drivers.servo.patience import ReplyPatience

PING_REPLY_BYTES: Final = STATUS_OVERHEAD_BYTES + 3


class PacketLink(ChainedWire):
    """Ask questions on the wire and tell their answers from what else is heard."""

    def detect_echo(self, servo_id: int, margin_s: float) -> None:
        """Find out by a ping whether the adapter hears what it sends, and go on accordingly.

        Raises:
            LinkLost: the adapter is gone.
        """
        frame = encode_instruction(servo_id, Instruction.PING)
        deadline_ns = self.ask(frame, len(frame) + PING_REPLY_BYTES, _ns(margin_s))
        heard = self.receive_all(len(frame), deadline_ns)
        self.echoes = heard == frame
        rest = PING_REPLY_BYTES if self.echoes else PING_REPLY_BYTES - len(heard)
        if heard:
            self.receive_all(rest, deadline_ns)

    def exchange(self, frame: bytes, reply_bytes: int, margin_s: float) -> tuple[bytes, int]:
        """Send a request and return what came of the expected bytes, and the deadline used.

        Raises:
            LinkLost: the adapter is gone.
        """
        deadline_ns = self.ask(frame, reply_bytes, _ns(margin_s))
        return self.receive_all(reply_bytes, deadline_ns), deadline_ns

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

    def sync_read(self, read: SyncRead, patience: ReplyPatience) -> dict[int, Entry]:
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
        patience: ReplyPatience,
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


def _ns(seconds: float) -> int:
    return round(seconds * NS_PER_S)


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


def _no_answer(name: str, patience: ReplyPatience, crc_errors: int) -> CorruptReply | ServoSilent:
    if crc_errors:
        return CorruptReply(
            f"{name}: {crc_errors} damaged answers in {patience.attempts} attempts; "
            "check cable, termination, and that no two servos share the id"
        )
    return ServoSilent(
        f"{name}: no answer in {patience.attempts} attempts; "
        "check its power, cable, id and baud rate"
    )
