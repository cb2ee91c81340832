"""Talk to whatever FEETECH servos are on a bus: their ids and models are asked for."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final, cast

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.errors import DriverError
from drivers.feetech.block import BLOCK_BYTES, BLOCK_START
from drivers.feetech.checks import all_troubles, read_head, read_images
from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    FEETECH_MAX_ID,
    OVERHEAD_BYTES,
    FeetechInstruction,
    FeetechPacket,
    FeetechParser,
    encode_packet,
)
from drivers.feetech.link import FeetechLink, value_in
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import (
    FEETECH_BAUD_RATES,
    FEETECH_MODELS,
    FEETECH_VOLTAGE_UNIT_V,
    LOAD_FULL,
    hardware_errors,
    model_names,
    models_of,
)
from drivers.feetech.tools.gentle_drive import FeetechDrive
from drivers.servo.counters import BusCounters
from drivers.servo.errors import CorruptReply, ServoSilent, WrongServo
from drivers.servo.fault_policy import describe_bits
from drivers.servo.joint_servo import JointServo
from drivers.servo.patience import ReplyPatience
from drivers.servo.tools.bench import (
    ONE_TRY,
    THREE_TRIES,
    FoundServo,
    Keep,
    RegisterValue,
    ServoReading,
    await_boot,
)
from drivers.servo.trouble import ServoTrouble

_SLOT_S: Final = 0.003
"""The longest that each servo's turn to answer a broadcast ping takes, its bytes left out."""
_PROBES: Final = 3
_MOST_AT_ONCE: Final = 40
_PROTOCOL_2_HEAD: Final = b"\xff\xff\xfd\x00"
_PROTOCOL_2_PING: Final = _PROTOCOL_2_HEAD + b"\xfe\x03\x00\x01\x31\x42"
HOMING: Final = "homing_offset"
_BAUD_CODES: Final = {rate: code for code, rate in FEETECH_BAUD_RATES.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class _FoundFeetech(FeetechServo):
    """Name only what the number tells, not the motor and gear that the robot file knows."""

    def __str__(self) -> str:
        name = _common_name(model_names(self.datasheet.number))
        return f"servo {self.id} ({self.joint}, {name})"


class FeetechBench:
    """Own the transport of a bus whose servos are not known beforehand.

    A model's number is sent low byte first by STS and SMS, high byte first by SCS: whichever of the
    two is known is taken.
    """

    all_ids: Final = range(FEETECH_MAX_ID + 1)
    factory_baud: Final = 1_000_000
    keeps: Final = (Keep.ID,)

    def __init__(self, transport: ByteTransport, clock: Clock, baud: int) -> None:
        self.counters = BusCounters()
        self.baud = baud
        self.link = FeetechLink(transport, clock, baud, self.counters)
        self._clock = clock

    def close(self) -> None:
        """Release the transport; closing twice is allowed."""
        self.link.close()

    def detect_echo(self) -> None:
        """Find out whether the adapter hears what it sends; then its echo is left out from now on.

        Raises:
            LinkLost: the adapter is gone.
        """
        self.link.detect_echo(FEETECH_MAX_ID, ONE_TRY.margin_s)

    def ping(self, servo_id: int, patience: ReplyPatience = THREE_TRIES) -> FoundServo:
        """Return what a servo says of itself.

        Raises:
            ServoSilent: no answer.
            CorruptReply: only damaged answers, as when two servos share the id.
            LinkLost: the adapter is gone.
        """
        head = read_head(self.link, _unnamed(servo_id), patience)
        names, number = models_of(head[3:5])
        return FoundServo(
            servo_id=servo_id,
            model_number=number,
            model_name=_common_name(names) or f"unknown model {number}",
            firmware=f"{head[0]}.{head[1]}",
        )

    def servo(self, servo_id: int, joint: str = "") -> FeetechServo:
        """Ask a servo for its model and return its description; `joint` is only for messages.

        Raises:
            ServoSilent: no answer.
            WrongServo: the model is not known, and so its registers are not.
            LinkLost: the adapter is gone.
        """
        found = self.ping(servo_id)
        names = model_names(found.model_number)
        if not names:
            raise WrongServo(
                f"servo {servo_id}: {found.model_name}; its registers are not known, only those of "
                f"{', '.join(sorted(FEETECH_MODELS))}"
            )
        return _FoundFeetech(id=servo_id, model_name=names[0], joint=joint or "bench")

    def ask_everyone(self) -> tuple[list[FoundServo], int]:
        """Return what answers when all are asked at once, and how many bytes were no answer.

        Raises:
            LinkLost: the adapter is gone.
        """
        packets, noise_bytes = self._listen(
            encode_packet(FEETECH_BROADCAST_ID, FeetechInstruction.PING),
            len(self.all_ids) * OVERHEAD_BYTES,
            len(self.all_ids) * _SLOT_S,
        )
        ids = sorted({packet.servo_id for packet in packets})
        if len(ids) < len(packets):
            noise_bytes += 1
        found = []
        for servo_id in ids[:_MOST_AT_ONCE]:
            try:
                found.append(self.ping(servo_id))
            except (ServoSilent, CorruptReply):
                noise_bytes += 1
        return found, noise_bytes

    def is_clash(self, servo_id: int) -> bool:
        """Return whether more than one servo answers to an id, by what two can never agree on.

        Raises:
            LinkLost: the adapter is gone.
        """
        frame = encode_packet(servo_id, FeetechInstruction.READ, bytes((BLOCK_START, BLOCK_BYTES)))
        for _ in range(_PROBES):
            answer = BLOCK_BYTES + OVERHEAD_BYTES
            packets, junk_bytes = self._listen(frame, 2 * answer, ONE_TRY.margin_s)
            if len(packets) < 2 and not junk_bytes:
                return False
        return True

    def other_family_ids(self) -> tuple[int, ...]:
        """Return ids that answer as Dynamixels of Protocol 2.0.

        Raises:
            LinkLost: the adapter is gone.
        """
        data, _ = self.link.exchange(_PROTOCOL_2_PING, 4 * 14, ONE_TRY.margin_s)
        starts = [at for at in range(len(data) - 4) if data.startswith(_PROTOCOL_2_HEAD, at)]
        return tuple(data[at + 4] for at in starts if data[at + 4] <= FEETECH_MAX_ID)

    def torque_is_on(self, servo: JointServo) -> bool:
        """Return whether a servo has torque.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return bool(self.link.read(_spec(servo), "torque_enable"))

    def release(self, servo: JointServo) -> None:
        """Take a servo's torque away.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.link.write(_spec(servo), "torque_enable", 0)

    def drive(self, servo: JointServo, torque_ratio: float) -> FeetechDrive:
        """Make ready to drive a servo with a share of its torque; nothing is written yet.

        Raises:
            WrongServo: it is in no position mode, or its torque cannot be bounded.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return FeetechDrive(self.link, _spec(servo), torque_ratio)

    def set_id(self, servo: JointServo, new_id: int) -> None:
        """Give a servo without torque another id, and lock that against a power cut.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._write_locked(_spec(servo), {"id": new_id})

    def set_limits(self, servo: JointServo, least: int, most: int) -> None:
        """Give a servo without torque other position limits, and lock that against a power cut.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        limits = {"min_position_limit": least, "max_position_limit": most}
        self._write_locked(_spec(servo), limits)

    def _write_locked(self, servo: FeetechServo, values: Mapping[str, int]) -> None:
        """Open the EEPROM for these values, whatever happens only for them."""
        self.link.write(servo, "lock", 0)
        try:
            for name, value in values.items():
                self.link.write(servo, name, value)
        except DriverError:
            with suppress(DriverError):  # the first error says what is wrong
                self.link.write(servo, "lock", 1)
            raise
        self.link.write(replace(servo, id=values.get("id", servo.id)), "lock", 1)

    def bauds(self, servo: JointServo) -> Collection[int]:
        """Return the speeds that a servo can be set to."""
        del servo
        return FEETECH_BAUD_RATES.values()

    def set_baud(self, servo: JointServo, baud: int) -> None:
        """Give a servo without torque another speed; it answers at that from now on.

        The EEPROM stays open until the servo is set up anew: locked it could be at the new speed
        only.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.link.write(_spec(servo), "lock", 0)
        self.link.write_each([_spec(servo)], "baud_rate", [_BAUD_CODES[baud]])

    def present_baud(self, servo: JointServo) -> int:
        """Return the speed that a servo says it is set to, and lock its EEPROM.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        code = self.link.read(_spec(servo), "baud_rate")
        self.link.write(_spec(servo), "lock", 1)
        return FEETECH_BAUD_RATES.get(code, 0)

    def hardware_error(self, servo: JointServo) -> int:
        """Return what a servo reports, as bits of `HardwareError`.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return hardware_errors(self.link.read(_spec(servo), "hardware_error_status"))

    def reboot(self, servo: JointServo) -> None:
        """Restart a servo and wait until it answers again.

        Raises:
            ServoSilent: it does not come back.
            LinkLost: the adapter is gone.
        """
        self.link.send(encode_packet(servo.id, FeetechInstruction.REBOOT))
        self.await_boot(servo.id)

    def factory_reset(self, servo: JointServo, keep: Keep) -> None:
        """Give the registers their factory values; the id stays, and nothing else.

        Raises:
            LinkLost: the adapter is gone.
        """
        del keep
        self.link.send(encode_packet(servo.id, FeetechInstruction.RESTORE))

    def await_boot(self, servo_id: int) -> FoundServo:
        """Ping until a restarted servo answers.

        Raises:
            ServoSilent: it does not come back within 3 s.
            LinkLost: the adapter is gone.
        """
        return await_boot(self, self._clock, servo_id)

    def registers(self, servo: JointServo) -> list[RegisterValue]:
        """Return every register of a servo, by address.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        spec = _spec(servo)
        return [
            RegisterValue(
                name=name,
                address=register.address,
                size=register.size,
                access=register.access,
                eeprom=register.eeprom,
                initial=register.initial if register.access == "rw" and register.eeprom else None,
                value=self.link.read(spec, name),
            )
            for name, register in spec.datasheet.registers.items()
        ]

    def positions(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the pulses of the encoders of the servos that answer, by id.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        spans = self.link.read_spans(specs, BLOCK_START, BLOCK_BYTES, THREE_TRIES)
        return {
            servo.id: value_in(servo, spans[servo.id].params, BLOCK_START, "present_position")
            for servo in specs
            if servo.id in spans
        }

    def examine(self, servos: Sequence[JointServo]) -> list[ServoTrouble]:
        """Compare servos with their declarations; silent ones are left out, nothing is written.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        return all_troubles(specs, read_images(self.link, specs, THREE_TRIES))

    def homing_offsets(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the homing offsets that servos hold, by id, of those that answer and have one.

        Raises:
            LinkLost: the adapter is gone.
        """
        found = {}
        for servo in map(_spec, servos):
            if HOMING not in servo.datasheet.registers:
                continue
            with suppress(ServoSilent, CorruptReply):
                found[servo.id] = self.link.read(servo, HOMING)
        return found

    def read_servos(
        self, servos: Sequence[JointServo], joints: Mapping[int, str]
    ) -> list[ServoReading]:
        """Return the readings of the servos that answer; `joints` names joints by servo id.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        sensed = self.link.read_spans(specs, BLOCK_START, BLOCK_BYTES, THREE_TRIES)
        torque = self.link.read_spans(specs, 40, 1, THREE_TRIES)
        return [
            _reading(servo, sensed[servo.id], torque[servo.id], joints.get(servo.id, ""))
            for servo in specs
            if servo.id in sensed and servo.id in torque
        ]

    def _listen(
        self, frame: bytes, reply_bytes: int, margin_s: float
    ) -> tuple[list[FeetechPacket], int]:
        """Send a frame and return all whole answers, and how many received bytes were none."""
        data, _ = self.link.exchange(frame, reply_bytes, margin_s)
        parser = FeetechParser()
        packets = [*parser.feed(data), *parser.salvage()]
        return packets, parser.discarded_bytes


def _reading(
    servo: FeetechServo, sensed: FeetechPacket, torque: FeetechPacket, joint: str
) -> ServoReading:
    sheet = servo.datasheet

    def value(name: str) -> int:
        return value_in(servo, sensed.params, BLOCK_START, name)

    return ServoReading(
        id=servo.id,
        joint=joint,
        model=_common_name(model_names(sheet.number)),
        position_rad=(value("present_position") - sheet.centre_step) * sheet.step_rad,
        velocity_rad_s=value("present_velocity") * sheet.step_rad,
        effort=100.0 * value("present_load") / LOAD_FULL,
        effort_unit="%",
        voltage_v=value("present_voltage") * FEETECH_VOLTAGE_UNIT_V,
        temperature_c=value("present_temperature"),
        torque_on=torque.params[0] == 1,
        errors=describe_bits(hardware_errors(sensed.code)),
    )


def _common_name(names: Sequence[str]) -> str:
    """Return what the names of motors with one number begin with."""
    return names[0].partition("-")[0] if names else ""


def _unnamed(servo_id: int) -> FeetechServo:
    return FeetechServo(id=servo_id, model_name=next(iter(FEETECH_MODELS)), joint="bench")


def _spec(servo: JointServo) -> FeetechServo:
    return cast("FeetechServo", servo)
