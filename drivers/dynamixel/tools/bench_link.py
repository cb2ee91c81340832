"""Talk to whatever servos are on a bus: their ids and models are asked for, not declared."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import MODELS_BY_NUMBER, ServoDatasheet
from drivers.dynamixel.tables.registers import Registers
from drivers.dynamixel.wire.codec import (
    MAX_SERVO_ID,
    Instruction,
    Packet,
    PacketParser,
    encode_instruction,
)
from drivers.dynamixel.wire.link import PacketLink
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES
from drivers.servo.counters import BusCounters
from drivers.servo.errors import ServoSilent, WrongServo
from drivers.servo.patience import ReplyPatience

PING_ANSWER_BYTES: Final = 3
ONE_TRY: Final = ReplyPatience(margin_s=0.02, attempts=1)
THREE_TRIES: Final = ReplyPatience(margin_s=0.02, attempts=3)
_BOOT_PATIENCE_S: Final = 3.0
_BOOT_POLL_S: Final = 0.05


class Keep(IntEnum):
    """Name what a factory reset leaves as it is; the values are those of the instruction."""

    NOTHING = 0xFF
    ID = 0x01
    ID_AND_BAUD = 0x02


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundServo:
    """Hold what a servo says of itself in answer to a ping."""

    servo_id: int
    model_number: int
    firmware: int

    @classmethod
    def of(cls, packet: Packet) -> "FoundServo":
        """Read the answer to a ping."""
        return cls(
            servo_id=packet.servo_id,
            model_number=int.from_bytes(packet.params[:2], "little"),
            firmware=packet.params[2],
        )

    @property
    def model(self) -> ServoDatasheet | None:
        """Return its control table, None for a model that is not registered."""
        return MODELS_BY_NUMBER.get(self.model_number)

    @property
    def model_name(self) -> str:
        """Return the model's name, or its number in words."""
        return self.model.name if self.model else f"unknown model {self.model_number}"


class BenchLink:
    """Own the transport of a bus whose servos are not known beforehand."""

    def __init__(self, transport: ByteTransport, clock: Clock, baud: int) -> None:
        self.counters = BusCounters()
        self.baud = baud
        self.link = PacketLink(transport, clock, baud, self.counters)
        self.registers = Registers(self.link)
        self._clock = clock

    def close(self) -> None:
        """Release the transport; closing twice is allowed."""
        self.link.close()

    def detect_echo(self) -> None:
        """Find out whether the adapter hears what it sends; then its echo is left out from now on.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.link.detect_echo(MAX_SERVO_ID, ONE_TRY.margin_s)

    def ping(self, servo_id: int, patience: ReplyPatience = THREE_TRIES) -> FoundServo:
        """Return what a servo says of itself.

        Raises:
            ServoSilent: no answer.
            CorruptReply: only damaged answers, as when two servos share the id.
            LinkLost: the adapter is gone.
        """
        packet = self.link.request(
            servo_id,
            Instruction.PING,
            b"",
            answer_bytes=PING_ANSWER_BYTES,
            patience=patience,
            name=f"ping servo {servo_id} at {self.baud} baud",
        )
        return FoundServo.of(packet)

    def servo(self, servo_id: int, joint: str = "") -> ServoSpec:
        """Ask a servo for its model and return its description; `joint` is only for messages.

        Raises:
            ServoSilent: no answer.
            WrongServo: the model is not registered, so that its registers are not known.
            LinkLost: the adapter is gone.
        """
        found = self.ping(servo_id)
        if found.model is None:
            known = ", ".join(sorted(model.name for model in MODELS_BY_NUMBER.values()))
            raise WrongServo(
                f"servo {servo_id}: {found.model_name}; its registers are not known, only those of "
                f"{known}"
            )
        return ServoSpec(id=servo_id, model_name=found.model.name, joint=joint or "bench")

    def read(self, servo: ServoSpec, name: str) -> int:
        """Return a register's value.

        Raises:
            ServoSilent: no answer.
            Rejected: the servo refuses.
            LinkLost: the adapter is gone.
        """
        return self.registers.read(servo, name)

    def write(self, servo: ServoSpec, name: str, value: int) -> None:
        """Write a register and wait for the servo's consent.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.registers.write(servo, name, value)

    def reboot(self, servo: ServoSpec) -> None:
        """Restart a servo and wait until it answers again.

        Raises:
            ServoSilent: it does not answer, or does not come back.
            LinkLost: the adapter is gone.
        """
        self.registers.reboot(servo)
        self.await_boot(servo.id)

    def factory_reset(self, servo: ServoSpec, keep: Keep) -> None:
        """Give the registers their factory values; the servo restarts by itself.

        Raises:
            RejectedAccess: torque is on.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.link.request(
            servo.id,
            Instruction.FACTORY_RESET,
            bytes((keep,)),
            answer_bytes=0,
            patience=ONE_TRY,
            name=f"factory reset of {servo}",
        )

    def await_boot(self, servo_id: int) -> FoundServo:
        """Ping until a restarted servo answers.

        Raises:
            ServoSilent: it does not come back within 3 s.
            LinkLost: the adapter is gone.
        """
        end_ns = self._clock.now_ns() + round(_BOOT_PATIENCE_S * NS_PER_S)
        while True:
            self._clock.sleep_until(self._clock.now_ns() + round(_BOOT_POLL_S * NS_PER_S))
            try:
                return self.ping(servo_id, ONE_TRY)
            except ServoSilent:
                if self._clock.now_ns() > end_ns:
                    raise

    def listen(
        self, servo_id: int, instruction: Instruction, params: bytes, answer_bytes: int
    ) -> tuple[list[Packet], int]:
        """Ask once and return all whole answers, and how many received bytes were none.

        Unlike a plain request this waits for twice the answer, so that a second servo shows.

        Raises:
            LinkLost: the adapter is gone.
        """
        frame = encode_instruction(servo_id, instruction, params)
        expected = answer_bytes + STATUS_OVERHEAD_BYTES
        return self.listen_raw(frame, 2 * expected, ONE_TRY.margin_s)

    def listen_raw(
        self, frame: bytes, reply_bytes: int, margin_s: float
    ) -> tuple[list[Packet], int]:
        """Send a frame and return all whole answers, and how many received bytes were none.

        Raises:
            LinkLost: the adapter is gone.
        """
        data, _ = self.link.exchange(frame, reply_bytes, margin_s)
        parser = PacketParser()
        parser.feed(data)
        packets = [one for one in parser.salvage() if one.instruction == Instruction.STATUS]
        return packets, parser.discarded_bytes
