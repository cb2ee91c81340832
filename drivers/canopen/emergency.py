"""Decode emergency messages (EMCY, CiA 301) into words."""

from dataclasses import dataclass

from drivers.canopen.error_codes import code_text, reset_rule
from drivers.canopen.objects import EMERGENCY_WIRE
from drivers.errors import ProtocolError
from drivers.wheel_drives.bus import ResetRule


@dataclass(frozen=True, slots=True, kw_only=True)
class Emergency:
    """Hold one emergency message of a drive."""

    code: int
    error_register: int
    vendor_data: bytes
    received_ns: int

    @property
    def is_reset(self) -> bool:
        """Return whether the message says that an error has gone."""
        return self.code >> 8 == 0

    @property
    def takes_all_back(self) -> bool:
        """Return whether none is left: while others last, the error register shows them."""
        return self.is_reset and not self.error_register

    @property
    def text(self) -> str:
        """Return the meaning of the code in words."""
        return code_text(self.code)

    @property
    def rule(self) -> ResetRule:
        """Return who may take the fault back."""
        return reset_rule(self.code)


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
