"""List the objects that the driver needs of a drive, and name those that its EDS file lacks."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from drivers.canopen.eds import DriveDictionary
from drivers.canopen.objects import (
    ABORT_CONNECTION_OPTION,
    CONTROLWORD,
    DEVICE_TYPE,
    ENCODER_RESOLUTION,
    FAULT_REACTION_OPTION,
    GEAR_RATIO,
    HEARTBEAT_CONSUMER,
    HEARTBEAT_PRODUCER,
    INTERPOLATION_PERIOD,
    MODE_DISPLAY,
    MODE_OF_OPERATION,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
    RATED_TORQUE,
    RPDO1,
    SUPPORTED_MODES,
    TORQUE_ACTUAL,
    TPDO1,
    TPDO2,
    DriveMode,
    Pdo,
    mapped_object,
)
from drivers.canopen.spec import DriveSpec
from drivers.errors import WrongDevice

_RAMPED: Final = (DriveMode.PROFILE_VELOCITY,)
_CYCLIC: Final = (DriveMode.CYCLIC_SYNCHRONOUS_VELOCITY,)
_ANY: Final = tuple(DriveMode)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """Say what an object is for; without one that is not `needed`, `lack` tells the consequence."""

    index: int
    purpose: str
    subindex: int = 0
    needed: bool = True
    lack: str = ""
    modes: tuple[DriveMode, ...] = _ANY


def _needed(
    index: int, purpose: str, subindex: int = 0, modes: tuple[DriveMode, ...] = _ANY
) -> Requirement:
    return Requirement(index=index, purpose=purpose, subindex=subindex, modes=modes)


def _useful(
    index: int,
    purpose: str,
    lack: str,
    subindex: int = 0,
    modes: tuple[DriveMode, ...] = _ANY,
) -> Requirement:
    return Requirement(
        index=index, purpose=purpose, subindex=subindex, needed=False, lack=lack, modes=modes
    )


REQUIREMENTS: Final = (
    _needed(DEVICE_TYPE, "device type"),
    _needed(HEARTBEAT_CONSUMER, "watch over the host's heartbeat", 1),
    _needed(HEARTBEAT_PRODUCER, "the drive's own heartbeat"),
    _needed(MODE_OF_OPERATION, "mode of operation"),
    _needed(MODE_DISPLAY, "mode of operation display"),
    _needed(PROFILE_ACCELERATION, "profile acceleration", modes=_RAMPED),
    _useful(PROFILE_DECELERATION, "profile deceleration", "6083 serves both ways", modes=_RAMPED),
    _useful(QUICK_STOP_OPTION, "quick stop option", "a quick stop is the drive's default"),
    _useful(QUICK_STOP_DECELERATION, "quick stop deceleration", "set it with the vendor's tool"),
    _useful(FAULT_REACTION_OPTION, "fault reaction option", "a fault's reaction is the default"),
    _useful(
        ABORT_CONNECTION_OPTION,
        "reaction to a lost host",
        "check in the drive's manual that it stops when the heartbeat is lost",
    ),
    _useful(SUPPORTED_MODES, "supported modes", "only the mode display can tell"),
    _useful(ENCODER_RESOLUTION, "encoder resolution", "`counts_per_rev` is not checked", 1),
    _useful(GEAR_RATIO, "gear ratio", "that counts are the motor's is not checked", 1),
    _useful(RATED_TORQUE, "rated torque", "the torque is not known"),
    _useful(TORQUE_ACTUAL, "torque", "the torque is not known"),
    _useful(
        INTERPOLATION_PERIOD,
        "interpolation period",
        "set the period of the setpoints with the vendor's tool",
        1,
        modes=_CYCLIC,
    ),
)


def check_dictionary(dictionary: DriveDictionary, spec: DriveSpec) -> tuple[str, ...]:
    """Return what the drive cannot do, in words.

    Raises:
        WrongDevice: it lacks objects that are needed; all of them are named.
    """
    lacking = [
        row
        for row in REQUIREMENTS
        if spec.mode in row.modes and not dictionary.has(row.index, row.subindex)
    ]
    faults = [_named(row) for row in lacking if row.needed]
    for pdo in (RPDO1, TPDO1, TPDO2):
        faults.extend(_unmappable(dictionary, pdo))
    if faults:
        raise WrongDevice(
            f"{spec.name}: its EDS file lacks {'; '.join(faults)}; take another EDS file or drive"
        )
    return tuple(f"{spec.name} has no {_named(row)}: {row.lack}" for row in lacking)


def _named(row: Requirement) -> str:
    return f"0x{row.index:04X}:{row.subindex:X} {row.purpose}"


def _unmappable(dictionary: DriveDictionary, pdo: Pdo) -> Iterator[str]:
    if not dictionary.has(pdo.communication, 1):
        yield f"0x{pdo.communication:04X} and with it a PDO"
    for entry in pdo.entries:
        index, _, bits = mapped_object(entry)
        optional = index == TORQUE_ACTUAL
        if not optional and not dictionary.mappable(index, bits):
            what = "controlword" if index == CONTROLWORD else "an object"
            yield f"{what} 0x{index:04X} of {bits} bits that can be mapped to a PDO"


def torque_is_told(dictionary: DriveDictionary) -> bool:
    """Return whether the drive sends its torque in a known unit."""
    return dictionary.mappable(TORQUE_ACTUAL, 16) and dictionary.has(RATED_TORQUE)
