"""Check that a FEETECH servo is the declared one, and write what this driver needs of it."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from drivers.errors import DriverError
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink, value_in
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import (
    FEETECH_MODELS,
    FEETECH_VOLTAGE_UNIT_V,
    MULTI_TURN_FEEDBACK,
    FeetechMode,
    TorqueSwitch,
    hardware_errors,
)
from drivers.servo.errors import NotKept, ServoSilent, SlowAdapter, WrongServo
from drivers.servo.patience import ReplyPatience

EEPROM_BYTES: Final = 40
_SENSED_START: Final = 56
_SENSED_BYTES: Final = 10
_ZERO_SPEED_IS_MOST: Final = 0x08
"""Bit of phase (18): a goal velocity of 0 does not limit the speed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechSetup:
    """Hold what was found in a servo, and what was written to it."""

    firmware: tuple[int, int]
    model_number: int
    minimum_pulse: int
    maximum_pulse: int
    torque_limit: int
    """In thousandths of full duty."""
    shutdown: int
    """Which errors take the torque away, as `HardwareError` bits."""
    torque_on: bool
    error: int
    written: tuple[str, ...]


def set_up_all(
    link: FeetechLink, servos: Sequence[FeetechServo], *, thorough: bool = True
) -> list[FeetechSetup]:
    """Find, check and set up every servo; torque is left as it is.

    Raises:
        SlowAdapter: the adapter holds back what it receives.
        ServoSilent: names all servos that do not answer, or the first unless `thorough`.
        WrongServo: names all that are not as declared.
        NotKept: a servo does not keep a setting.
        LinkLost: the adapter is gone.
    """
    if link.adapter_fault:
        raise SlowAdapter(link.adapter_fault)
    link.detect_echo(servos[0].id, 0.02)
    images = link.read_spans(servos if thorough else servos[:1], 0, EEPROM_BYTES)
    _require_all(servos if thorough else servos[:1], images)
    if not thorough:
        images |= link.read_spans(servos[1:], 0, EEPROM_BYTES)
        _require_all(servos, images)
    sensed = link.read_spans(servos, _SENSED_START, _SENSED_BYTES)
    _require_all(servos, sensed)
    torque = {servo.id: link.read(servo, "torque_enable") for servo in servos}
    faults = [
        fault
        for servo in servos
        for fault in (
            *_identity_faults(servo, images[servo.id].params),
            *_supply_faults(servo, sensed[servo.id].params),
            *_torque_faults(servo, images[servo.id].params, torque[servo.id]),
        )
    ]
    faults += _firmware_faults(servos, {id_: packet.params for id_, packet in images.items()})
    if faults:
        raise WrongServo("\n".join(faults))
    return [
        _set_up(link, servo, images[servo.id].params, torque[servo.id], sensed[servo.id].code)
        for servo in servos
    ]


def wanted_settings(servo: FeetechServo, image: bytes) -> dict[str, int]:
    """Return the EEPROM settings that this driver needs."""
    wanted = {"return_delay_time": 0, "status_return_level": 1}
    if "operating_mode" in servo.datasheet.registers:
        phase = value_in(servo, image, 0, "phase")
        wanted["operating_mode"] = FeetechMode.POSITION
        wanted["phase"] = phase & ~MULTI_TURN_FEEDBACK | _ZERO_SPEED_IS_MOST
    return wanted


def differences(servo: FeetechServo, image: bytes) -> dict[str, tuple[int, int]]:
    """Return (present, wanted) of the settings that differ, by register name."""
    found = {
        name: (value_in(servo, image, 0, name), value)
        for name, value in wanted_settings(servo, image).items()
    }
    return {name: pair for name, pair in found.items() if pair[0] != pair[1]}


def write_kept_settings(
    link: FeetechLink,
    servo: FeetechServo,
    image: bytes,
    patience: ReplyPatience = SETUP_PATIENCE,
) -> Iterator[str]:
    """Write the settings that differ, so that they outlive a power cut, and lock them.

    It yields what was changed, one transaction at each step, "" where nothing was.

    Raises:
        NotKept: a setting reads as another value than was written.
        ServoSilent: no answer.
    """
    changes = differences(servo, image)
    try:
        if changes:
            link.write(servo, "lock", 0, patience)
        for name, (old, new) in changes.items():
            yield ""
            link.write(servo, name, new, patience)
            yield ""
            if (kept := link.read(servo, name, patience)) != new:
                raise NotKept(f"{servo}: {name} expected {new}, got {kept} after writing it")
            yield f"{name} {old} -> {new}"
    except DriverError:
        with suppress(DriverError):  # the first error says what is wrong
            link.write(servo, "lock", 1, patience)
        raise
    link.write(servo, "lock", 1, patience)


def _set_up(
    link: FeetechLink, servo: FeetechServo, image: bytes, torque: int, error: int
) -> FeetechSetup:
    written = tuple(text for text in write_kept_settings(link, servo, image) if text)
    minimum = value_in(servo, image, 0, "min_position_limit")
    maximum = value_in(servo, image, 0, "max_position_limit")
    if minimum == maximum == 0:  # no limits: but for the one turn that is shown
        minimum, maximum = 0, 2 * servo.datasheet.centre_step + 1
    return FeetechSetup(
        firmware=(image[0], image[1]),
        model_number=value_in(servo, image, 0, "model_number"),
        minimum_pulse=minimum,
        maximum_pulse=maximum,
        torque_limit=value_in(servo, image, 0, "max_torque_limit"),
        shutdown=hardware_errors(value_in(servo, image, 0, "shutdown")),
        torque_on=torque == TorqueSwitch.ON,
        error=hardware_errors(error),
        written=written,
    )


def _require_all(servos: Sequence[FeetechServo], answers: Collection[int]) -> None:
    silent = [str(servo) for servo in servos if servo.id not in answers]
    if silent:
        raise ServoSilent(
            f"no answer from {', '.join(silent)}; check power, cable, id and speed "
            "(a supply of another voltage than the servo's version silences it, too)"
        )


def _identity_faults(servo: FeetechServo, image: bytes) -> list[str]:
    number = value_in(servo, image, 0, "model_number")
    if number != servo.datasheet.number:
        known = sorted(name for name, sheet in FEETECH_MODELS.items() if sheet.number == number)
        return [
            f"{servo}: expected model {servo.datasheet.number}, got {number} "
            f"({' or '.join(known) or 'unknown'}); correct the robot file or swap the servo"
        ]
    found, least = (image[0], image[1]), servo.datasheet.min_firmware
    if found < least:
        return [
            f"{servo}: firmware {least[0]}.{least[1]} or newer is needed, got "
            f"{found[0]}.{found[1]}: sync reads of older ones come damaged; update it with "
            "FEETECH's FD software"
        ]
    return []


def _firmware_faults(servos: Sequence[FeetechServo], images: dict[int, bytes]) -> list[str]:
    by_model: dict[int, dict[str, list[str]]] = {}
    for servo in servos:
        image = images[servo.id]
        versions = by_model.setdefault(servo.datasheet.number, {})
        versions.setdefault(f"{image[0]}.{image[1]}", []).append(servo.joint)
    return [
        "servos of one model have different firmware: "
        + "; ".join(f"{version}: {', '.join(joints)}" for version, joints in versions.items())
        + "; update the older ones with FEETECH's FD software"
        for versions in by_model.values()
        if len(versions) > 1
    ]


def _supply_faults(servo: FeetechServo, sensed: bytes) -> list[str]:
    volts = value_in(servo, sensed, _SENSED_START, "present_voltage") * FEETECH_VOLTAGE_UNIT_V
    low, high = servo.datasheet.voltage_range_v
    if low <= volts <= high:
        return []
    return [
        f"{servo}: expected a supply of {low:g} to {high:g} V, got {volts:.1f} V; another version "
        "of the servo is built in than the robot file says, or the supply is the wrong one: "
        "disconnect it before it is damaged"
    ]


def _torque_faults(servo: FeetechServo, image: bytes, torque: int) -> list[str]:
    if not torque:
        return []
    return [
        f"{servo}: expected {name} {new}, got {old}, and torque is on; disable torque, then "
        "connect again"
        for name, (old, new) in differences(servo, image).items()
    ]
