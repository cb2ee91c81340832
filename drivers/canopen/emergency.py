"""Decode emergency messages (EMCY, CiA 301) into words."""

from dataclasses import dataclass
from typing import Final

from drivers.canopen.objects import EMERGENCY_WIRE
from drivers.errors import ProtocolError

# CiA 301 (80xx and classes) and CiA 402-2, error codes
CODE_TEXTS: Final[dict[int, str]] = {
    0x0000: "error reset",
    0x2310: "continuous over-current",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x4210: "device over-temperature",
    0x4310: "drive over-temperature",
    0x7305: "encoder fault",
    0x8110: "CAN overrun",
    0x8130: "heartbeat of the master lost",
    0x8140: "recovered from bus off",
    0x8400: "velocity controller",
}
CLASS_TEXTS: Final[dict[int, str]] = {
    0x0: "error reset",
    0x1: "generic error",
    0x2: "current",
    0x3: "voltage",
    0x4: "temperature",
    0x5: "device hardware",
    0x6: "device software",
    0x7: "additional modules",
    0x8: "monitoring",
    0x9: "external error",
    0xF: "device specific",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Emergency:
    """Hold one emergency message of a drive."""

    code: int
    error_register: int
    vendor_data: bytes
    received_ns: int

    @property
    def is_reset(self) -> bool:
        """Tell whether the message says that errors have gone."""
        return self.code >> 8 == 0

    @property
    def text(self) -> str:
        """Return the meaning of the code in words."""
        fallback = CLASS_TEXTS.get(self.code >> 12, "reserved code")
        return f"0x{self.code:04X} {CODE_TEXTS.get(self.code, fallback)}"


def decode_emergency(data: bytes, received_ns: int) -> Emergency:
    """Decode the eight bytes of an emergency message.

    Raises:
        ProtocolError: the message is not eight bytes long.
    """
    if len(data) != EMERGENCY_WIRE.size:
        raise ProtocolError(f"EMCY has {len(data)} bytes, expected {EMERGENCY_WIRE.size}")
    code, register, vendor = EMERGENCY_WIRE.unpack(data)
    return Emergency(
        code=code, error_register=register, vendor_data=vendor, received_ns=received_ns
    )
