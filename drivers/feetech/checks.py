"""Compare what FEETECH servos hold with what their robot file declares; nothing is written."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.feetech.codec import FeetechInstruction
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink, value_in
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import (
    FEETECH_VOLTAGE_UNIT_V,
    FINE_SPEEDS,
    MULTI_TURN_FEEDBACK,
    hardware_errors,
    model_names,
    models_of,
)
from drivers.servo.patience import ReplyPatience
from drivers.servo.state import hardware_error_text
from drivers.servo.trouble import ServoTrouble, TroubleLevel, limit_troubles

EEPROM_BYTES: Final = 40
_HEAD_BYTES: Final = 5  # firmware .. model number
_SWITCHES_START: Final = 40
_SWITCHES_BYTES: Final = 16  # torque_enable .. lock
_SENSED_START: Final = 56
_SENSED_BYTES: Final = 10  # present_position .. hardware_error_status
_ZERO_SPEED_IS_MOST: Final = 0x08
"""Bit of phase (18): a goal velocity of 0 does not limit the speed."""
_OTHER_VERSION_V: Final = 2.0
"""A max_voltage_limit (14) that differs by more is another version's: they have 8 V and 14 V."""
_UPDATE: Final = "update it with FEETECH's FD software (Windows)"


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechImage:
    """Hold what one servo was found to hold, in spans of its table."""

    eeprom: bytes
    switches: bytes
    sensed: bytes

    def value(self, servo: FeetechServo, name: str) -> int:
        """Return the value of a register."""
        address = servo.datasheet.registers[name].address
        if address >= _SENSED_START:
            return value_in(servo, self.sensed, _SENSED_START, name)
        if address >= _SWITCHES_START:
            return value_in(servo, self.switches, _SWITCHES_START, name)
        return value_in(servo, self.eeprom, 0, name)

    @property
    def firmware(self) -> tuple[int, int]:
        """Return the version of the firmware."""
        return self.eeprom[0], self.eeprom[1]


def read_images(
    link: FeetechLink, servos: Sequence[FeetechServo], patience: ReplyPatience = SETUP_PATIENCE
) -> dict[int, FeetechImage]:
    """Return what servos hold, by id, without those that are silent or damaged.

    Raises:
        LinkLost: the adapter is gone.
    """
    spans = (0, EEPROM_BYTES), (_SWITCHES_START, _SWITCHES_BYTES), (_SENSED_START, _SENSED_BYTES)
    found = [link.read_spans(servos, *span, patience) for span in spans]
    return {
        servo.id: FeetechImage(
            eeprom=found[0][servo.id].params,
            switches=found[1][servo.id].params,
            sensed=found[2][servo.id].params,
        )
        for servo in servos
        if all(servo.id in each for each in found)
    }


def read_head(
    link: FeetechLink, servo: FeetechServo, patience: ReplyPatience = SETUP_PATIENCE
) -> bytes:
    """Return firmware and model number of a servo, bytes 0 to 4, which every model has.

    Raises:
        ServoSilent: no answer.
        CorruptReply: only damaged answers, as when two servos share the id.
        LinkLost: the adapter is gone.
    """
    packet = link.request(
        servo,
        FeetechInstruction.READ,
        bytes((0, _HEAD_BYTES)),
        answer_bytes=_HEAD_BYTES,
        patience=patience,
    )
    return packet.params


def wrong_model(servo: FeetechServo, head: bytes) -> ServoTrouble:
    """Return what is said of a servo of another model than declared."""
    names, number = models_of(head[3:5])
    return ServoTrouble(
        measured=f"{servo}: expected model {servo.datasheet.number}, got {number} "
        f"({' or '.join(sorted(names)) or 'unknown'})",
        remedy="correct the robot file or swap the servo",
    )


def all_troubles(
    servos: Sequence[FeetechServo], images: Mapping[int, FeetechImage]
) -> list[ServoTrouble]:
    """Judge the servos of a bus of which there is an image, each for itself and all together."""
    answering = [servo for servo in servos if servo.id in images]
    found = [trouble for servo in answering for trouble in _servo_troubles(servo, images[servo.id])]
    return [*found, *_mixed_firmware(answering, images), *_open_locks(answering, images)]


def differences(servo: FeetechServo, eeprom: bytes) -> dict[str, tuple[int, int]]:
    """Return (present, wanted) of the settings that this driver writes, where they differ."""
    wanted = {"return_delay_time": 0, "status_return_level": 1}
    if "operating_mode" in servo.datasheet.registers:
        phase = value_in(servo, eeprom, 0, "phase")
        wanted["operating_mode"] = servo.mode
        wanted["phase"] = phase & ~MULTI_TURN_FEEDBACK | _ZERO_SPEED_IS_MOST
        if servo.wheel is not None:
            wanted["phase"] |= FINE_SPEEDS
    found = {name: (value_in(servo, eeprom, 0, name), value) for name, value in wanted.items()}
    return {name: pair for name, pair in found.items() if pair[0] != pair[1]}


def position_limits(servo: FeetechServo, eeprom: bytes) -> tuple[int, int]:
    """Return between which steps a servo takes goals; 0 and 0 are no limits, so the one turn."""
    least = value_in(servo, eeprom, 0, "min_position_limit")
    most = value_in(servo, eeprom, 0, "max_position_limit")
    return (least, most) if least or most else (0, 2 * servo.datasheet.centre_step + 1)


def _servo_troubles(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    number = image.value(servo, "model_number")
    if number != servo.datasheet.number:
        yield wrong_model(servo, image.eeprom)
        return  # the other registers may mean something else
    yield from _old_firmware(servo, image)
    yield from _supply(servo, image)
    yield from _other_version(servo, image)
    yield from _torque(servo, image)
    yield from limit_troubles(servo, *position_limits(servo, image.eeprom))
    yield from _errors(servo, image)


def _old_firmware(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    found, least = image.firmware, servo.datasheet.min_firmware
    if found < least:
        yield ServoTrouble(
            measured=f"{servo}: firmware {least[0]}.{least[1]} or newer is needed, got "
            f"{found[0]}.{found[1]}: sync reads of older ones come damaged",
            remedy=_UPDATE,
        )


def _mixed_firmware(
    servos: Sequence[FeetechServo], images: Mapping[int, FeetechImage]
) -> Iterator[ServoTrouble]:
    by_model: dict[int, dict[str, list[str]]] = {}
    for servo in servos:
        major, minor = images[servo.id].firmware
        versions = by_model.setdefault(servo.datasheet.number, {})
        versions.setdefault(f"{major}.{minor}", []).append(servo.joint)
    for versions in by_model.values():
        if len(versions) > 1:
            listed = (f"{version}: {', '.join(joints)}" for version, joints in versions.items())
            yield ServoTrouble(
                measured=f"servos of one model have different firmware: {'; '.join(listed)}",
                remedy="update the older ones with FEETECH's FD software (Windows)",
            )


def _supply(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    volts = image.value(servo, "present_voltage") * FEETECH_VOLTAGE_UNIT_V
    low, high = servo.datasheet.voltage_range_v
    if not low <= volts <= high:
        yield ServoTrouble(
            measured=f"{servo}: expected a supply of {low:g} to {high:g} V, got {volts:.1f} V",
            remedy="another version of the servo is built in than the robot file says, or the "
            "supply is the wrong one: disconnect it before it is damaged",
        )


def _other_version(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    """Distinguish versions that share a number by the limit that their factory gives them."""
    sheet = servo.datasheet
    if len(model_names(sheet.number)) < 2:
        return
    limit_v = image.value(servo, "max_voltage_limit") * FEETECH_VOLTAGE_UNIT_V
    usual_v = sheet.registers["max_voltage_limit"].initial * FEETECH_VOLTAGE_UNIT_V
    if abs(limit_v - usual_v) > _OTHER_VERSION_V:
        yield ServoTrouble(
            measured=f"{servo}: expected max_voltage_limit {usual_v:.1f} V, as this version for "
            f"{sheet.voltage_v:g} V leaves its factory, got {limit_v:.1f} V: another version, or "
            "changed by other software",
            remedy="read the label of the servo; correct supply and model in the robot file",
            level=TroubleLevel.FAULT,
        )


def _torque(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    if image.value(servo, "torque_enable"):
        for name, (old, new) in differences(servo, image.eeprom).items():
            yield ServoTrouble(
                measured=f"{servo}: expected {name} {new}, got {old}, and torque is on",
                remedy="disable torque, then connect again",
            )


def _errors(servo: FeetechServo, image: FeetechImage) -> Iterator[ServoTrouble]:
    error = hardware_errors(image.value(servo, "hardware_error_status"))
    if error:
        yield ServoTrouble(
            measured=f"{servo}: reports {hardware_error_text(error)}",
            remedy=f"remove the cause, then `vla-deploy servo reboot {servo.id}`; an overload may "
            "need its power to be cut",
            level=TroubleLevel.FAULT,
        )


def _open_locks(
    servos: Sequence[FeetechServo], images: Mapping[int, FeetechImage]
) -> Iterator[ServoTrouble]:
    opened = [str(one.id) for one in servos if not images[one.id].value(one, "lock")]
    if opened:
        yield ServoTrouble(
            measured=f"servo {', '.join(opened)}: expected lock 1, got 0: what any program writes "
            "to the EEPROM stays there, and wears it",
            remedy="none needed before `vla-deploy run`, which locks it; LeRobot leaves it open",
            level=TroubleLevel.NOTE,
        )
