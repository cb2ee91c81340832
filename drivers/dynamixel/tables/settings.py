"""Write what a servo needs for this driver where it differs, and tell what was written."""

from collections.abc import Iterator

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import StatusReturnLevel
from drivers.dynamixel.tables.layout import Block
from drivers.dynamixel.tables.registers import SETUP, Registers, decode
from drivers.servo.errors import NotKept
from drivers.servo.patience import ReplyPatience

IMAGE_BYTES = 71  # model number .. hardware error status


def wanted(servo: ServoSpec) -> dict[str, int]:
    """Return the EEPROM settings that this driver needs."""
    return {"return_delay_time": 0, "operating_mode": servo.operating_mode}


def differences(servo: ServoSpec, image: bytes) -> dict[str, tuple[int, int]]:
    """Return (present, wanted) of the settings that differ, by register name."""
    found = {name: (decode(servo, image, 0, name), value) for name, value in wanted(servo).items()}
    return {name: pair for name, pair in found.items() if pair[0] != pair[1]}


def write_differences(
    registers: Registers, servo: ServoSpec, image: bytes, patience: ReplyPatience = SETUP
) -> Iterator[str]:
    """Write the settings that differ, one at each step, and yield what was changed.

    Raises:
        Rejected: the servo refuses a setting.
        ServoSilent: no answer.
    """
    for name, (old, new) in differences(servo, image).items():
        registers.write(servo, name, new, patience)
        yield f"{name} {old} -> {new}"


def write_map(
    registers: Registers, servo: ServoSpec, block: Block, patience: ReplyPatience = SETUP
) -> Iterator[str]:
    """Point the servo's indirect addresses at the block's sources, one transaction at each step.

    Raises:
        NotKept: the servo holds other addresses than were written.
        Rejected: the servo refuses.
        ServoSilent: no answer.
    """
    if block.map_address is None:
        return
    size = len(block.map_bytes)
    if registers.read_span(servo, block.map_address, size, patience) == block.map_bytes:
        return
    yield ""
    registers.write_span(servo, block.map_address, block.map_bytes, patience)
    yield ""
    if registers.read_span(servo, block.map_address, size, patience) != block.map_bytes:
        raise NotKept(
            f"{servo}: the indirect addresses at {block.map_address} do not hold what was written; "
            "set the layout to direct"
        )
    yield f"indirect addresses at {block.map_address}"


def bring_back(
    registers: Registers, servo: ServoSpec, block: Block, patience: ReplyPatience
) -> Iterator[str]:
    """Set up a servo that was away, one transaction at each step; torque is left as it is.

    A servo that has kept its torque has not lost its memory either. One without has, or may have.

    Raises:
        NotKept: the servo does not keep what is written.
        Rejected: the servo refuses.
        ServoSilent: no answer.
    """
    registers.write_many("status_return_level", [servo], StatusReturnLevel.ALL)
    image = registers.read_span(servo, 0, IMAGE_BYTES, patience)
    if decode(servo, image, 0, "torque_enable"):
        yield ""
        return
    yield "torque is off until it is armed anew"
    yield from write_differences(registers, servo, image, patience)
    yield from write_map(registers, servo, block, patience)
