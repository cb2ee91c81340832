"""Talk to whatever servos are on a bus: their ids and models are asked for, not declared."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final, cast

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.dynamixel.checks import servo_troubles
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import (
    BAUD_RATES,
    CENTRE_PULSE,
    MODELS_BY_NUMBER,
    PULSE_RAD,
    VOLTAGE_UNIT_V,
)
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.dynamixel.tables.settings import IMAGE_BYTES
from drivers.dynamixel.tools.gentle_drive import DynamixelDrive
from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    MAX_SERVO_ID,
    Instruction,
    Packet,
    PacketParser,
    encode_instruction,
)
from drivers.dynamixel.wire.link import PacketLink
from drivers.dynamixel.wire.sync_read import STATUS_OVERHEAD_BYTES
from drivers.servo.counters import BusCounters
from drivers.servo.errors import WrongServo
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

PING_ANSWER_BYTES: Final = 3
_SLOT_S: Final = 0.003
"""The longest that each servo's turn to answer a broadcast ping takes, its bytes left out."""
_PROBES: Final = 3
_PROBED_ADDRESS: Final = 120  # realtime_tick .. present_temperature: two servos never agree on it
_PROBED_BYTES: Final = 27
_PROTOCOL_1_PING: Final = b"\xff\xff\xfe\x02\x01\xfe"
_PROTOCOL_1_STATUS_BYTES: Final = 6
_STATUS: Final = (64, 7)  # torque_enable .. hardware_error_status
_SENSED: Final = (124, 23)  # present_pwm .. present_temperature
_KEEP: Final = {Keep.NOTHING: 0xFF, Keep.ID: 0x01, Keep.ID_AND_BAUD: 0x02}
"""Parameters of the factory reset."""
_BAUD_CODES: Final = {rate: code for code, rate in BAUD_RATES.items()}


def found_servo(packet: Packet) -> FoundServo:
    """Read the answer to a ping."""
    number = int.from_bytes(packet.params[:2], "little")
    model = MODELS_BY_NUMBER.get(number)
    return FoundServo(
        servo_id=packet.servo_id,
        model_number=number,
        model_name=model.name if model else f"unknown model {number}",
        firmware=str(packet.params[2]),
    )


class DynamixelBench:
    """Own the transport of a bus whose servos are not known beforehand."""

    all_ids: Final = range(MAX_SERVO_ID + 1)
    factory_baud: Final = 57_600
    keeps: Final = tuple(Keep)

    def __init__(self, transport: ByteTransport, clock: Clock, baud: int) -> None:
        self.counters = BusCounters()
        self.baud = baud
        self.link = PacketLink(transport, clock, baud, self.counters)
        self._registers = Registers(self.link)
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
        return found_servo(packet)

    def servo(self, servo_id: int, joint: str = "") -> ServoSpec:
        """Ask a servo for its model and return its description; `joint` is only for messages.

        Raises:
            ServoSilent: no answer.
            WrongServo: the model is not registered, so that its registers are not known.
            LinkLost: the adapter is gone.
        """
        found = self.ping(servo_id)
        if found.model_number not in MODELS_BY_NUMBER:
            known = ", ".join(sorted(model.name for model in MODELS_BY_NUMBER.values()))
            raise WrongServo(
                f"servo {servo_id}: {found.model_name}; its registers are not known, only those of "
                f"{known}"
            )
        return ServoSpec(id=servo_id, model_name=found.model_name, joint=joint or "bench")

    def read(self, servo: JointServo, name: str) -> int:
        """Return a register's value.

        Raises:
            ServoSilent: no answer.
            Rejected: the servo refuses.
            LinkLost: the adapter is gone.
        """
        return self._registers.read(_spec(servo), name)

    def write(self, servo: JointServo, name: str, value: int) -> None:
        """Write a register and wait for the servo's consent.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self._registers.write(_spec(servo), name, value)

    def torque_is_on(self, servo: JointServo) -> bool:
        """Return whether a servo has torque.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return bool(self.read(servo, "torque_enable"))

    def release(self, servo: JointServo) -> None:
        """Take a servo's torque away.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.write(servo, "torque_enable", 0)

    def drive(self, servo: JointServo, torque_ratio: float) -> DynamixelDrive:
        """Make ready to drive a servo with a share of its torque; nothing is written yet.

        Raises:
            WrongServo: it is in no position mode, or its torque cannot be bounded.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return DynamixelDrive(self._registers, _spec(servo), torque_ratio)

    def set_id(self, servo: JointServo, new_id: int) -> None:
        """Give a servo without torque another id.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.write(servo, "id", new_id)

    def set_limits(self, servo: JointServo, least: int, most: int) -> None:
        """Give a servo without torque other position limits, in pulses.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.write(servo, "min_position_limit", least)
        self.write(servo, "max_position_limit", most)

    def bauds(self, servo: JointServo) -> Collection[int]:
        """Return the speeds that a servo can be set to."""
        most = _spec(servo).model.registers["baud_rate"].maximum
        return [rate for code, rate in BAUD_RATES.items() if most is None or code <= most]

    def set_baud(self, servo: JointServo, baud: int) -> None:
        """Give a servo without torque another speed; it answers at that from now on.

        Raises:
            Rejected: the servo refuses; the class tells why.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.write(servo, "baud_rate", _BAUD_CODES[baud])

    def present_baud(self, servo: JointServo) -> int:
        """Return the speed that a servo says it is set to.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return BAUD_RATES.get(self.read(servo, "baud_rate"), 0)

    def hardware_error(self, servo: JointServo) -> int:
        """Return what a servo reports, as bits of `HardwareError`.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return self.read(servo, "hardware_error_status")

    def registers(self, servo: JointServo) -> list[RegisterValue]:
        """Return every register of a servo, by address.

        Raises:
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        return [
            RegisterValue(
                name=name,
                address=register.address,
                size=register.size,
                access=register.access,
                eeprom=register.eeprom,
                initial=register.initial,
                value=self.read(servo, name),
            )
            for name, register in _spec(servo).model.registers.items()
        ]

    def positions(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the pulses of the encoders of the servos that answer, by id.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        return self._registers.read_many("present_position", specs, THREE_TRIES)

    def examine(self, servos: Sequence[JointServo]) -> list[ServoTrouble]:
        """Compare servos with their declarations; silent ones are left out, nothing is written.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        images = self._registers.read_span_many(specs, 0, IMAGE_BYTES, THREE_TRIES)
        return [
            trouble
            for servo in specs
            if (image := images.get(servo.id)) is not None
            for trouble in servo_troubles(servo, image)
        ]

    def homing_offsets(self, servos: Sequence[JointServo]) -> dict[int, int]:
        """Return the homing offsets that servos hold, by id, of those that answer.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        return self._registers.read_many("homing_offset", specs, THREE_TRIES)

    def read_servos(
        self, servos: Sequence[JointServo], joints: Mapping[int, str]
    ) -> list[ServoReading]:
        """Return the readings of the servos that answer; the link counts what goes wrong.

        `joints` names joints by servo id; "" is the joint of a servo that is not in it.

        Raises:
            LinkLost: the adapter is gone.
        """
        specs = [_spec(servo) for servo in servos]
        statuses = self._registers.read_span_many(specs, *_STATUS, THREE_TRIES)
        spans = self._registers.read_span_many(specs, *_SENSED, THREE_TRIES)
        return [
            _reading(servo, statuses[servo.id], spans[servo.id], joints.get(servo.id, ""))
            for servo in specs
            if servo.id in statuses and servo.id in spans
        ]

    def reboot(self, servo: JointServo) -> None:
        """Restart a servo and wait until it answers again.

        Raises:
            ServoSilent: it does not answer, or does not come back.
            LinkLost: the adapter is gone.
        """
        self._registers.reboot(_spec(servo))
        self.await_boot(servo.id)

    def factory_reset(self, servo: JointServo, keep: Keep) -> None:
        """Give the registers their factory values; the servo restarts by itself.

        Raises:
            RejectedAccess: torque is on.
            ServoSilent: no answer.
            LinkLost: the adapter is gone.
        """
        self.link.request(
            servo.id,
            Instruction.FACTORY_RESET,
            bytes((_KEEP[keep],)),
            answer_bytes=0,
            patience=ONE_TRY,
            name=f"factory reset of {servo}",
        )

    def is_clash(self, servo_id: int) -> bool:
        """Return whether more than one servo answers to an id, by what two can never agree on.

        One clean answer is enough for a no, so that neither noise nor a late answer looks like a
        clash.

        Raises:
            LinkLost: the adapter is gone.
        """
        params = _PROBED_ADDRESS.to_bytes(2, "little") + _PROBED_BYTES.to_bytes(2, "little")
        for _ in range(_PROBES):
            packets, junk_bytes = self.listen(servo_id, Instruction.READ, params, _PROBED_BYTES)
            if len(packets) < 2 and not junk_bytes:
                return False
        return True

    def ask_everyone(self) -> tuple[list[FoundServo], int]:
        """Return what answers when all are asked at once, and how many bytes were no answer.

        Raises:
            LinkLost: the adapter is gone.
        """
        packets, noise_bytes = self.listen_raw(
            encode_instruction(BROADCAST_ID, Instruction.PING),
            len(self.all_ids) * (PING_ANSWER_BYTES + STATUS_OVERHEAD_BYTES),
            len(self.all_ids) * _SLOT_S,
        )
        answers = [packet for packet in packets if len(packet.params) == PING_ANSWER_BYTES]
        return [found_servo(packet) for packet in answers], noise_bytes

    def other_family_ids(self) -> tuple[int, ...]:
        """Return ids that answer in Protocol 1.0 (AX, MX), whose frames are FEETECH's, too.

        Raises:
            LinkLost: the adapter is gone.
        """
        size = _PROTOCOL_1_STATUS_BYTES
        data, _ = self.link.exchange(_PROTOCOL_1_PING, 4 * size, ONE_TRY.margin_s)
        frames = [
            data[at : at + size]
            for at in range(len(data) - size + 1)
            if data.startswith(b"\xff\xff", at)
        ]
        return tuple(
            frame[2] for frame in frames if frame[3] == 2 and sum(frame[2:]) & 0xFF == 0xFF
        )

    def await_boot(self, servo_id: int) -> FoundServo:
        """Ping until a restarted servo answers.

        Raises:
            ServoSilent: it does not come back within 3 s.
            LinkLost: the adapter is gone.
        """
        return await_boot(self, self._clock, servo_id)

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


def _spec(servo: JointServo) -> ServoSpec:
    return cast("ServoSpec", servo)


def _reading(servo: ServoSpec, status: bytes, span: bytes, joint: str) -> ServoReading:
    model, start = servo.model, _SENSED[0]
    has_current = model.current_unit_a is not None
    effort = decode(servo, span, start, "present_current" if has_current else "present_load")
    return ServoReading(
        id=servo.id,
        joint=joint,
        model=model.name,
        position_rad=(decode(servo, span, start, "present_position") - CENTRE_PULSE) * PULSE_RAD,
        velocity_rad_s=decode(servo, span, start, "present_velocity") * model.velocity_unit_rad_s,
        effort=effort * (model.current_unit_a or 0.1),
        effort_unit="A" if has_current else "%",
        voltage_v=decode(servo, span, start, "present_input_voltage") * VOLTAGE_UNIT_V,
        temperature_c=decode(servo, span, start, "present_temperature"),
        torque_on=bool(decode(servo, status, _STATUS[0], "torque_enable")),
        errors=describe_bits(decode(servo, status, _STATUS[0], "hardware_error_status")),
    )
