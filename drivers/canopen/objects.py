"""Name the objects, frames and commands of CiA 301 and CiA 402 that a wheel drive uses.

Shared by the driver and by the twin's emulated drive. The EDS file holds the full dictionary.
"""

import struct
from dataclasses import dataclass, replace
from enum import IntEnum
from pathlib import Path
from typing import Final

EDS_PATH: Final = Path(__file__).with_name("wheel_drive.eds")

# CiA 301: function codes of the pre-defined connection set
NMT_COB: Final = 0x000
SYNC_COB: Final = 0x080
EMERGENCY_COB: Final = 0x080
SDO_REPLY_COB: Final = 0x580
SDO_REQUEST_COB: Final = 0x600
HEARTBEAT_COB: Final = 0x700
FUNCTION_CODE_MASK: Final = 0x780

# CiA 301: communication objects
DEVICE_TYPE: Final = 0x1000
ERROR_REGISTER: Final = 0x1001
ERROR_FIELD: Final = 0x1003
HEARTBEAT_CONSUMER: Final = 0x1016
HEARTBEAT_PRODUCER: Final = 0x1017
IDENTITY: Final = 0x1018

# CiA 402: drive objects
ABORT_CONNECTION_OPTION: Final = 0x6007
ERROR_CODE: Final = 0x603F
CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
QUICK_STOP_OPTION: Final = 0x605A
FAULT_REACTION_OPTION: Final = 0x605E
MODE_OF_OPERATION: Final = 0x6060
MODE_DISPLAY: Final = 0x6061
POSITION_ACTUAL: Final = 0x6064
VELOCITY_DEMAND: Final = 0x606B
VELOCITY_ACTUAL: Final = 0x606C
VELOCITY_WINDOW: Final = 0x606D
VELOCITY_THRESHOLD: Final = 0x606F
RATED_TORQUE: Final = 0x6076
TORQUE_ACTUAL: Final = 0x6077
PROFILE_ACCELERATION: Final = 0x6083
PROFILE_DECELERATION: Final = 0x6084
QUICK_STOP_DECELERATION: Final = 0x6085
ENCODER_RESOLUTION: Final = 0x608F
GEAR_RATIO: Final = 0x6091
INTERPOLATION_PERIOD: Final = 0x60C2
TARGET_VELOCITY: Final = 0x60FF
SUPPORTED_MODES: Final = 0x6502

CIA402_PROFILE: Final = 402
RATED_TORQUE_PER_NM: Final = 1000
TORQUE_STEPS_PER_RATED: Final = 1000


class NmtCommand(IntEnum):
    """Name what the network master can order (CiA 301, NMT)."""

    START = 0x01
    STOP = 0x02
    PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """Name what a heartbeat says."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class DriveMode(IntEnum):
    """Name the modes of operation (6060) a wheel drive knows."""

    PROFILE_VELOCITY = 3
    CYCLIC_SYNCHRONOUS_VELOCITY = 9

    @property
    def words(self) -> str:
        """Return the mode's name in words."""
        return self.name.lower().replace("_", " ")


class AbortConnection(IntEnum):
    """Name the reactions to a lost master (6007)."""

    NOTHING = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Pdo:
    """Describe one process data object: its configuration objects and its packing."""

    cob_base: int
    communication: int
    mapping: int
    transmission: int
    entries: tuple[int, ...]
    wire: struct.Struct


def mapping_entry(index: int, bits: int) -> int:
    """Return the mapping parameter of a whole object."""
    return index << 16 | bits


def mapped_object(entry: int) -> tuple[int, int, int]:
    """Return index, sub-index and length in bits of a mapping parameter."""
    return entry >> 16, entry >> 8 & 0xFF, entry & 0xFF


RPDO1: Final = Pdo(
    cob_base=0x200,
    communication=0x1400,
    mapping=0x1600,
    transmission=255,
    entries=(mapping_entry(CONTROLWORD, 16), mapping_entry(TARGET_VELOCITY, 32)),
    wire=struct.Struct("<Hi"),
)
TPDO1: Final = Pdo(
    cob_base=0x180,
    communication=0x1800,
    mapping=0x1A00,
    transmission=1,
    entries=(mapping_entry(STATUSWORD, 16), mapping_entry(VELOCITY_ACTUAL, 32)),
    wire=struct.Struct("<Hi"),
)
TPDO2: Final = Pdo(
    cob_base=0x280,
    communication=0x1801,
    mapping=0x1A01,
    transmission=1,
    entries=(mapping_entry(POSITION_ACTUAL, 32), mapping_entry(TORQUE_ACTUAL, 16)),
    wire=struct.Struct("<ih"),
)
TPDO2_WITHOUT_TORQUE: Final = replace(TPDO2, entries=TPDO2.entries[:1], wire=struct.Struct("<i"))
PDOS: Final = (RPDO1, TPDO1, TPDO2)
EMERGENCY_WIRE: Final = struct.Struct("<HB5s")
