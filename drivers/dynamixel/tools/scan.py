"""Find what answers on a bus at one speed: servos, ids that clash, another protocol, noise.

All servos are asked at once first. Where that gives damaged answers, each id is asked by itself:
of two servos with one id neither is understood.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.dynamixel.tools.bench_link import (
    ONE_TRY,
    PING_ANSWER_BYTES,
    THREE_TRIES,
    BenchLink,
    FoundServo,
)
from drivers.dynamixel.wire.codec import BROADCAST_ID, MAX_SERVO_ID, Instruction, encode_instruction
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES
from drivers.errors import NoReply, ProtocolError
from drivers.servo.errors import CorruptReply, ServoSilent
from drivers.servo.patience import ReplyPatience

ALL_IDS: Final = range(MAX_SERVO_ID + 1)
_SLOT_S: Final = 0.003
"""The longest that each servo's turn to answer a broadcast ping takes, its bytes left out."""
_PROBES: Final = 3
_PROBED_ADDRESS: Final = 120  # realtime_tick .. present_temperature: two servos never agree on it
_PROBED_BYTES: Final = 27
_PROTOCOL_1_PING: Final = b"\xff\xff\xfe\x02\x01\xfe"
_PROTOCOL_1_STATUS_BYTES: Final = 6

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedReport:
    """Hold what was found at one speed."""

    baud: int
    servos: tuple[FoundServo, ...] = ()
    clashes: tuple[int, ...] = ()
    """Ids that more than one servo has; the cable may be at fault where it spoils every answer."""
    protocol_1_ids: tuple[int, ...] = ()
    """Ids that answer in Protocol 1.0 (AX, MX, and other makes), which is not spoken here."""
    noise_bytes: int = 0
    """Received bytes that made no packet, as from servos at another speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoScan:
    """Hold what was found on a port at several speeds, the bus' own first.

    `declared` has joint and model of the servos that a robot file puts on the bus, by id;
    `is_complete` says that all ids were asked.
    """

    port: str
    reports: Sequence[SpeedReport]
    declared: Mapping[int, tuple[str, str]]
    is_complete: bool

    @property
    def missing(self) -> list[int]:
        """Return the declared servos that do not answer at the bus' own speed."""
        if not self.is_complete:
            return []
        own = self.reports[0]
        answered = {one.servo_id for one in own.servos} | set(own.clashes)
        return sorted(self.declared.keys() - answered)

    def fault(self) -> str:
        """Return what is wrong with the bus and what to try; "" where nothing is."""
        for report in self.reports:
            if report.clashes:
                ids = ", ".join(map(str, report.clashes))
                return (
                    f"{self.port} at {report.baud} baud: the answers of id {ids} are damaged: more "
                    "than one servo has it, or the cable is bad. Connect one of them alone and "
                    "give it a free id: vla-deploy servo set-id"
                )
        if not any(report.servos for report in self.reports):
            return self._nothing_found()
        if self.missing:
            names = ", ".join(map(self._label, self.missing))
            return (
                f"{self.port} at {self.reports[0].baud} baud: no answer from {names}; check power, "
                "cable and speed (see the table for servos at another speed)"
            )
        wrong = [
            f"{self._label(one.servo_id)} is {one.model_name}, the robot file says "
            f"{self.declared[one.servo_id][1]}"
            for one in self.reports[0].servos
            if one.servo_id in self.declared and self.declared[one.servo_id][1] != one.model_name
        ]
        return f"{'; '.join(wrong)}; correct the robot file or the wiring" if wrong else ""

    def _label(self, servo_id: int) -> str:
        return f"servo {servo_id} ({self.declared[servo_id][0]})"

    def _nothing_found(self) -> str:
        for report in self.reports:
            if report.protocol_1_ids:
                ids = ", ".join(map(str, report.protocol_1_ids))
                return (
                    f"{self.port} at {report.baud} baud: id {ids} answers in Protocol 1.0, only "
                    "2.0 is spoken here; set the servo's protocol_type to 2, if it has one"
                )
        for report in self.reports:
            if report.noise_bytes:
                return (
                    f"{self.port}: bytes came at {report.baud} baud, but no packet: another speed, "
                    "an adapter that echoes, or another device; check the adapter's mode"
                )
        asked = ", ".join(str(report.baud) for report in self.reports)
        return f"{self.port}: no servo answers at {asked} baud; check power, cable and port"


def scan_speed(
    link: BenchLink, ids: Sequence[int] | None = None, progress: Progress = lambda text: None
) -> SpeedReport:
    """Return what answers at the link's speed: of all ids, or of the given ones.

    Raises:
        LinkLost: the adapter is gone.
    """
    noise_bytes, doubtful = 0, True
    if ids is None:
        progress(f"{link.baud} baud: all ids at once")
        servos, noise_bytes = _ask_everyone(link)
        doubtful = noise_bytes > 0 or len({one.servo_id for one in servos}) < len(servos)
        ids = ALL_IDS if doubtful else sorted(one.servo_id for one in servos)
    patience = ONE_TRY if doubtful else THREE_TRIES
    found, clashes = _ask_each(link, ids, patience, progress)
    return SpeedReport(
        baud=link.baud,
        servos=tuple(found),
        clashes=tuple(clashes),
        protocol_1_ids=() if found or clashes else _ask_protocol_1(link),
        noise_bytes=0 if found or clashes else noise_bytes,
    )


def is_clash(link: BenchLink, servo_id: int) -> bool:
    """Return whether more than one servo answers to an id, by what two can never agree on.

    One clean answer is enough for a no, so that neither noise nor a late answer looks like a clash.

    Raises:
        LinkLost: the adapter is gone.
    """
    params = _PROBED_ADDRESS.to_bytes(2, "little") + _PROBED_BYTES.to_bytes(2, "little")
    for _ in range(_PROBES):
        packets, junk_bytes = link.listen(servo_id, Instruction.READ, params, _PROBED_BYTES)
        if len(packets) < 2 and not junk_bytes:
            return False
    return True


def is_taken(link: BenchLink, servo_id: int) -> bool:
    """Return whether anything answers to an id; a damaged answer counts.

    Raises:
        LinkLost: the adapter is gone.
    """
    try:
        link.ping(servo_id)
    except NoReply:
        return False
    except ProtocolError:
        return True
    return True


def _ask_everyone(link: BenchLink) -> tuple[list[FoundServo], int]:
    packets, noise_bytes = link.listen_raw(
        encode_instruction(BROADCAST_ID, Instruction.PING),
        len(ALL_IDS) * (PING_ANSWER_BYTES + STATUS_OVERHEAD_BYTES),
        len(ALL_IDS) * _SLOT_S,
    )
    answers = [packet for packet in packets if len(packet.params) == PING_ANSWER_BYTES]
    return [FoundServo.of(packet) for packet in answers], noise_bytes


def _ask_each(
    link: BenchLink, ids: Iterable[int], patience: ReplyPatience, progress: Progress
) -> tuple[list[FoundServo], list[int]]:
    found, clashes = [], []
    for servo_id in ids:
        progress(f"{link.baud} baud: id {servo_id}")
        try:
            servo = link.ping(servo_id, patience)
        except ServoSilent:
            continue
        except CorruptReply:  # something answers; what it is shows next
            servo = None
        if is_clash(link, servo_id):
            clashes.append(servo_id)
        else:
            found.append(servo or link.ping(servo_id))
    return found, clashes


def _ask_protocol_1(link: BenchLink) -> tuple[int, ...]:
    data, _ = link.link.exchange(_PROTOCOL_1_PING, 4 * _PROTOCOL_1_STATUS_BYTES, ONE_TRY.margin_s)
    frames = [
        data[at : at + _PROTOCOL_1_STATUS_BYTES]
        for at in range(len(data) - _PROTOCOL_1_STATUS_BYTES + 1)
        if data.startswith(b"\xff\xff", at)
    ]
    return tuple(frame[2] for frame in frames if frame[3] == 2 and sum(frame[2:]) & 0xFF == 0xFF)
