"""Compare what Dynamixels hold with what their robot file declares; nothing is written."""

from typing import Final

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import MODELS_BY_NUMBER, OperatingMode
from drivers.dynamixel.tables.layout import BlockLayout, block_of
from drivers.dynamixel.tables.registers import decode
from drivers.dynamixel.tables.settings import differences
from drivers.servo.state import hardware_error_text
from drivers.servo.trouble import ServoTrouble, TroubleLevel, limit_troubles

EXTENDED_RANGE: Final = (-1_048_575, 1_048_575)
_NO_SECONDARY_ID: Final = 255
_EXPECTED: Final = {
    "homing_offset": (0, "keep offsets in the robot file"),
    "drive_mode": (0, "keep directions in the robot file, and profiles velocity-based"),
    "startup_configuration": (0, "a servo must not power its motor by itself"),
    "secondary_id": (_NO_SECONDARY_ID, "a servo must not obey another one's commands"),
}
_MODEL_NUMBER: Final = slice(0, 2)
_FIRMWARE: Final = 6
_UPDATE: Final = "update it with DYNAMIXEL Wizard"


def servo_troubles(servo: ServoSpec, image: bytes) -> list[ServoTrouble]:
    """Judge all that a servo's registers from address 0 on say of it."""
    number, firmware = int.from_bytes(image[_MODEL_NUMBER], "little"), image[_FIRMWARE]
    troubles = identity_troubles(servo, number, firmware)
    if number != servo.model.number:
        return troubles  # the other registers may mean something else
    return [*troubles, *image_troubles(servo, image), *_error_troubles(servo, image)]


def identity_troubles(
    servo: ServoSpec,
    number: int,
    firmware: int,
    *,
    fast_sync: bool | None = None,
    layout: BlockLayout = BlockLayout.AUTO,
) -> list[ServoTrouble]:
    """Judge the model and the firmware of a servo."""
    if number != servo.model.number:
        got = MODELS_BY_NUMBER.get(number)
        return [
            ServoTrouble(
                measured=f"{servo}: expected model {servo.model.number}, got {number} "
                f"({got.name if got else 'unknown'})",
                remedy="correct the robot file or swap the servo",
            )
        ]
    least, fast = servo.model.min_firmware_watchdog, servo.model.min_firmware_fast_sync
    troubles = []
    if firmware < least:
        measured = f"{servo}: the Bus Watchdog needs firmware {least}, got {firmware}"
        troubles.append(ServoTrouble(measured=measured, remedy=_UPDATE))
    if fast_sync and fast is None:
        measured = f"{servo}: the model has no fast sync read"
        troubles.append(ServoTrouble(measured=measured, remedy="set fast_sync = false"))
    if fast_sync and fast is not None and firmware < fast:
        measured = f"{servo}: fast sync read needs firmware {fast}, got {firmware}"
        remedy = f"{_UPDATE} or set fast_sync = false"
        troubles.append(ServoTrouble(measured=measured, remedy=remedy))
    try:
        block_of(servo.model, firmware, layout)
    except ValueError as error:
        troubles.append(ServoTrouble(measured=f"{servo}: {error}", remedy="use layout direct"))
    return troubles


def image_troubles(servo: ServoSpec, image: bytes) -> list[ServoTrouble]:
    """Judge the settings, limits and errors in a servo's registers from address 0 on."""
    troubles = [
        ServoTrouble(
            measured=f"{servo}: expected {name} {wanted}, got {got}",
            remedy=f"{reason}, then write {wanted}",
        )
        for name, (wanted, reason) in _EXPECTED.items()
        if name in servo.model.registers and (got := decode(servo, image, 0, name)) != wanted
    ]
    if decode(servo, image, 0, "torque_enable"):
        troubles += [
            ServoTrouble(
                measured=f"{servo}: expected {name} {new}, got {old}, and torque is on, which "
                "locks it",
                remedy="disable torque, then connect again",
            )
            for name, (old, new) in differences(servo, image).items()
        ]
    return [*troubles, *limit_troubles(servo, *position_limits(servo, image))]


def _error_troubles(servo: ServoSpec, image: bytes) -> list[ServoTrouble]:
    """Return what a servo reports of itself; only a reboot ends it."""
    error = decode(servo, image, 0, "hardware_error_status")
    if not error:
        return []
    return [
        ServoTrouble(
            measured=f"{servo}: reports {hardware_error_text(error)}",
            remedy=f"remove the cause, then `vla-deploy servo reboot {servo.id}`",
            level=TroubleLevel.FAULT,
        )
    ]


def position_limits(servo: ServoSpec, image: bytes) -> tuple[int, int]:
    """Return between which pulses a servo takes goals."""
    if servo.operating_mode != OperatingMode.POSITION:
        return EXTENDED_RANGE
    return (
        decode(servo, image, 0, "min_position_limit"),
        decode(servo, image, 0, "max_position_limit"),
    )
