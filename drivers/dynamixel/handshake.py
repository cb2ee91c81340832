"""Make sure that the servos on the bus are those of the robot file, set up for this driver."""

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import (
    MODELS_BY_NUMBER,
    WATCHDOG_TRIPPED,
    OperatingMode,
    StatusReturnLevel,
)
from drivers.dynamixel.tables.layout import Block, BlockLayout, block_of
from drivers.dynamixel.tables.registers import Registers, decode
from drivers.dynamixel.tables.settings import IMAGE_BYTES, differences, write_differences, write_map
from drivers.dynamixel.wire.baud_search import where_they_answer
from drivers.errors import NoReply
from drivers.servo.errors import ServoSilent, SlowAdapter, WrongServo

_EXTENDED_RANGE = (-1_048_575, 1_048_575)
_ECHO_MARGIN_S = 0.02
_NO_SECONDARY_ID = 255
_EXPECTED = {
    "homing_offset": (0, "keep offsets in the robot file"),
    "drive_mode": (0, "keep directions in the robot file, and profiles velocity-based"),
    "startup_configuration": (0, "a servo must not power its motor by itself"),
    "secondary_id": (_NO_SECONDARY_ID, "a servo must not obey another one's commands"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoSetup:
    """Hold what the handshake learned of one servo, and what it has written there."""

    firmware: int
    minimum_pulse: int
    maximum_pulse: int
    pwm_limit: int
    torque_on: bool
    error: int
    watchdog: int
    block: Block
    fast_sync: bool
    written: tuple[str, ...] = ()
    """The settings that were changed: name, old value -> new value."""

    @property
    def watchdog_tripped(self) -> bool:
        """Return whether the servo stopped by itself when its last host fell silent."""
        return self.watchdog == WATCHDOG_TRIPPED


def shake_hands(
    registers: Registers,
    servos: Sequence[ServoSpec],
    *,
    fast_sync: bool | None,
    layout: BlockLayout,
    thorough: bool,
) -> list[ServoSetup]:
    """Check adapter and servos, write settings that differ, and return what was learned.

    Torque is left as it is. `fast_sync` None uses the fast sync read wherever a servo has it.

    Raises:
        SlowAdapter: the adapter holds back what it receives.
        ServoSilent: names all servos that do not answer, and the speed at which they would; the
            first one only, unless `thorough`.
        WrongServo: names all that are not as declared, with expected and got.
        Rejected: a servo refuses a setting.
        LinkLost: the adapter is gone.
    """
    link = registers.link
    if fault := link.adapter_fault:
        raise SlowAdapter(fault)
    link.detect_echo(servos[0].id, _ECHO_MARGIN_S)
    identities = _ping_all(registers, servos, thorough=thorough)
    firmwares = [firmware for _, firmware in identities]
    faults = [
        fault
        for servo, (number, firmware) in zip(servos, identities, strict=True)
        for fault in _identity_faults(servo, number, firmware, fast_sync=fast_sync, layout=layout)
    ]
    _raise_faults(faults)
    registers.write_many("status_return_level", servos, StatusReturnLevel.ALL)
    images = [registers.read_span(servo, 0, IMAGE_BYTES) for servo in servos]
    for servo, image in zip(servos, images, strict=True):
        faults += _setting_faults(servo, image)
    _raise_faults(faults)
    return [
        _set_up(registers, servo, image, firmware, fast_sync=fast_sync, layout=layout)
        for servo, image, firmware in zip(servos, images, firmwares, strict=True)
    ]


def _ping_all(
    registers: Registers, servos: Sequence[ServoSpec], *, thorough: bool
) -> list[tuple[int, int]]:
    found: list[tuple[int, int]] = []
    silent: list[ServoSpec] = []
    for servo in servos:
        try:
            found.append(registers.ping(servo))
        except NoReply:
            if not thorough:
                raise
            silent.append(servo)
    if silent:
        names = ", ".join(str(servo) for servo in silent)
        raise ServoSilent(
            f"{len(silent)} of {len(servos)} servos do not answer at "
            f"{registers.link.baud} baud: {names}; " + _remedy(registers, silent)
        )
    return found


def _remedy(registers: Registers, silent: Sequence[ServoSpec]) -> str:
    found = where_they_answer(registers, silent)
    if not found:
        return "check motor power, the cable before the first of them, ids and baud rate"
    wanted = registers.link.baud
    return "; ".join(
        f"servo {servo_id} answers at {baud} baud: set it to {wanted} "
        f"(`vla-deploy servo set-baud`), or correct the robot file"
        for servo_id, baud in found.items()
    )


def _identity_faults(
    servo: ServoSpec, number: int, firmware: int, *, fast_sync: bool | None, layout: BlockLayout
) -> list[str]:
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
    try:
        block_of(servo.model, firmware, layout)
    except ValueError as error:
        faults.append(f"{servo}: {error}")
    return faults


def _setting_faults(servo: ServoSpec, image: bytes) -> list[str]:
    faults = [
        f"{servo}: expected {name} {wanted}, got {got}; {reason}, then write {wanted}"
        for name, (wanted, reason) in _EXPECTED.items()
        if name in servo.model.registers and (got := decode(servo, image, 0, name)) != wanted
    ]
    if decode(servo, image, 0, "torque_enable"):
        faults += [
            f"{servo}: expected {name} {new}, got {old}, "
            "and torque is on, which locks it; disable torque, then connect again"
            for name, (old, new) in differences(servo, image).items()
        ]
    return faults


def _set_up(
    registers: Registers,
    servo: ServoSpec,
    image: bytes,
    firmware: int,
    *,
    fast_sync: bool | None,
    layout: BlockLayout,
) -> ServoSetup:
    block = block_of(servo.model, firmware, layout)
    written = [*write_differences(registers, servo, image), *write_map(registers, servo, block)]
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
        block=block,
        fast_sync=servo.model.has_fast_sync(firmware) if fast_sync is None else fast_sync,
        written=tuple(text for text in written if text),
    )


def _raise_faults(faults: Sequence[str]) -> None:
    if faults:
        raise WrongServo("\n".join(faults))
