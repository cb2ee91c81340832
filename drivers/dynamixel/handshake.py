"""Make sure that the servos on the bus are those of the robot file, set up for this driver."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.dynamixel.control_table import (
    MODELS_BY_NUMBER,
    WATCHDOG_TRIPPED,
    OperatingMode,
    StatusReturnLevel,
)
from drivers.dynamixel.errors import ServoSilent, WrongServo
from drivers.dynamixel.registers import Registers, decode
from drivers.dynamixel.servo import ServoSpec
from drivers.errors import NoReply

_EXTENDED_RANGE = (-1_048_575, 1_048_575)
_IMAGE_END = 71  # model number .. hardware error status
_EXPECTED = {
    "homing_offset": "keep offsets in the robot file",
    "drive_mode": "keep directions in the robot file, and profiles velocity-based",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSetup:
    """Hold what the handshake learned of one servo."""

    firmware: int
    minimum_pulse: int
    maximum_pulse: int
    pwm_limit: int
    torque_on: bool
    error: int
    watchdog: int

    @property
    def watchdog_tripped(self) -> bool:
        """Tell whether the servo stopped by itself when its last host fell silent."""
        return self.watchdog == WATCHDOG_TRIPPED


def shake_hands(
    registers: Registers, servos: Sequence[ServoSpec], *, fast_sync: bool
) -> list[ServoSetup]:
    """Check every servo, write settings that differ, and return what was learned.

    Torque is left as it is.

    Raises:
        ServoSilent: names all servos that do not answer.
        WrongServo: names all that are not as declared, with expected and got.
        Rejected: a servo refuses a setting.
        LinkLost: the adapter is gone.
    """
    identities = _ping_all(registers, servos)
    faults = [
        fault
        for servo, (number, firmware) in zip(servos, identities, strict=True)
        for fault in _identity_faults(servo, number, firmware, fast_sync=fast_sync)
    ]
    _raise_faults(faults)
    registers.write_many("status_return_level", servos, StatusReturnLevel.ALL)
    images = [registers.read_span(servo, 0, _IMAGE_END) for servo in servos]
    for servo, image in zip(servos, images, strict=True):
        faults += _setting_faults(servo, image)
    _raise_faults(faults)
    for servo, image in zip(servos, images, strict=True):
        _write_differences(registers, servo, image)
    return [
        _setup(registers, servo, image, firmware)
        for servo, image, (_, firmware) in zip(servos, images, identities, strict=True)
    ]


def _ping_all(registers: Registers, servos: Sequence[ServoSpec]) -> list[tuple[int, int]]:
    found, silent = [], []
    for servo in servos:
        try:
            found.append(registers.ping(servo))
        except NoReply:
            silent.append(str(servo))
    if silent:
        raise ServoSilent(
            f"{len(silent)} of {len(servos)} servos do not answer: {', '.join(silent)}; "
            "check motor power, the cable before the first of them, ids and baud rate"
        )
    return found


def _identity_faults(servo: ServoSpec, number: int, firmware: int, *, fast_sync: bool) -> list[str]:
    if number != servo.model.number:
        got = MODELS_BY_NUMBER.get(number)
        return [
            f"{servo}: expected model {servo.model.number}, got {number} "
            f"({got.name if got else 'unknown'}); correct the robot file or swap the servo"
        ]
    least, fast = servo.model.min_firmware_watchdog, servo.model.min_firmware_fast_sync
    faults = []
    if firmware < least:
        faults.append(
            f"{servo}: the Bus Watchdog needs firmware {least}, got {firmware}; "
            "update it with DYNAMIXEL Wizard"
        )
    if fast_sync and fast is None:
        faults.append(f"{servo}: the model has no fast sync read; set fast_sync = false")
    if fast_sync and fast is not None and firmware < fast:
        faults.append(
            f"{servo}: fast sync read needs firmware {fast}, got {firmware}; "
            "update it with DYNAMIXEL Wizard or set fast_sync = false"
        )
    return faults


def _wanted(servo: ServoSpec) -> dict[str, int]:
    return {"return_delay_time": 0, "operating_mode": servo.operating_mode}


def _differences(servo: ServoSpec, image: bytes) -> dict[str, int]:
    return {
        name: value
        for name, value in _wanted(servo).items()
        if decode(servo, image, 0, name) != value
    }


def _setting_faults(servo: ServoSpec, image: bytes) -> list[str]:
    faults = [
        f"{servo}: expected {name} 0, got {got}; {reason}, then write 0"
        for name, reason in _EXPECTED.items()
        if (got := decode(servo, image, 0, name)) != 0
    ]
    if decode(servo, image, 0, "torque_enable"):
        faults += [
            f"{servo}: expected {name} {value}, got {decode(servo, image, 0, name)}, "
            "and torque is on, which locks it; disable torque, then connect again"
            for name, value in _differences(servo, image).items()
        ]
    return faults


def _write_differences(registers: Registers, servo: ServoSpec, image: bytes) -> None:
    for name, value in _differences(servo, image).items():
        registers.write(servo, name, value)


def _setup(registers: Registers, servo: ServoSpec, image: bytes, firmware: int) -> ServoSetup:
    minimum, maximum = _EXTENDED_RANGE
    if servo.operating_mode == OperatingMode.POSITION:
        minimum = decode(servo, image, 0, "min_position_limit")
        maximum = decode(servo, image, 0, "max_position_limit")
    return ServoSetup(
        firmware=firmware,
        minimum_pulse=minimum,
        maximum_pulse=maximum,
        pwm_limit=decode(servo, image, 0, "pwm_limit"),
        torque_on=bool(decode(servo, image, 0, "torque_enable")),
        error=decode(servo, image, 0, "hardware_error_status"),
        watchdog=registers.read(servo, "bus_watchdog"),
    )


def _raise_faults(faults: Sequence[str]) -> None:
    if faults:
        raise WrongServo("\n".join(faults))
