"""Check that a FEETECH servo is the declared one, and write what this driver needs of it."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

from drivers.errors import DriverError
from drivers.feetech.checks import (
    EEPROM_BYTES,
    FeetechImage,
    all_troubles,
    differences,
    position_limits,
    read_images,
)
from drivers.feetech.link import SETUP_PATIENCE, FeetechLink
from drivers.feetech.servo import FeetechServo
from drivers.feetech.silence import SILENCE_REMEDY, silence_error
from drivers.feetech.table import TorqueSwitch, hardware_errors
from drivers.servo.errors import NotKept, ServoSilent, SlowAdapter, WrongServo
from drivers.servo.patience import ReplyPatience
from drivers.servo.trouble import refusals


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
    if not thorough:
        _require_all(servos[:1], link.read_spans(servos[:1], 0, EEPROM_BYTES))
    images = read_images(link, servos)
    if thorough and (silent := [servo for servo in servos if servo.id not in images]):
        raise silence_error(link, silent)
    _require_all(servos, images)
    if faults := refusals(all_troubles(servos, images)):
        raise WrongServo("\n".join(faults))
    return [_set_up(link, servo, images[servo.id]) for servo in servos]


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


def _set_up(link: FeetechLink, servo: FeetechServo, image: FeetechImage) -> FeetechSetup:
    written = tuple(text for text in write_kept_settings(link, servo, image.eeprom) if text)
    limit = image.value(servo, "max_torque_limit")
    return setup_of(servo, image, torque_limit=limit, written=written)


def setup_of(
    servo: FeetechServo, image: FeetechImage, *, torque_limit: int, written: tuple[str, ...] = ()
) -> FeetechSetup:
    """Return what was found in a servo, with the torque limit that it is to have."""
    minimum, maximum = position_limits(servo, image.eeprom)
    return FeetechSetup(
        firmware=image.firmware,
        model_number=image.value(servo, "model_number"),
        minimum_pulse=minimum,
        maximum_pulse=maximum,
        torque_limit=torque_limit,
        shutdown=hardware_errors(image.value(servo, "shutdown")),
        torque_on=image.value(servo, "torque_enable") == TorqueSwitch.ON,
        error=hardware_errors(image.value(servo, "hardware_error_status")),
        written=written,
    )


def _require_all(servos: Sequence[FeetechServo], answers: Collection[int]) -> None:
    silent = [str(servo) for servo in servos if servo.id not in answers]
    if silent:
        raise ServoSilent(f"no answer from {', '.join(silent)}; {SILENCE_REMEDY}")
