"""Lay out, as data, the block that is read from every servo in each cycle.

DIRECT is the three neighbouring registers 126..135. INDIRECT adds what else tells of a servo's
health, gathered by the servo itself through its indirect addresses, so that one read brings all.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import Final

from drivers.dynamixel.tables.model import ServoDatasheet


class BlockLayout(Enum):
    """Choose the block of a bus."""

    AUTO = "auto"
    """INDIRECT for every servo that has the slots, DIRECT for the others."""
    DIRECT = "direct"
    INDIRECT = "indirect"


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """Place one value inside the block."""

    start: int
    size: int
    signed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Say where a servo's block is read and, by name, what lies where in it.

    `map_address` is where its `sources` are written, byte by byte; None when there is no map.
    """

    address: int
    size: int
    fields: Mapping[str, Field]
    map_address: int | None = None
    sources: tuple[int, ...] = ()

    @property
    def map_bytes(self) -> bytes:
        """Return what the indirect addresses must hold."""
        return b"".join(source.to_bytes(2, "little") for source in self.sources)


MOTION: Final = ("position", "velocity", "effort")
CLIMATE: Final = ("voltage", "temperature")
STATUS: Final = ("torque_enable", "hardware_error", "bus_watchdog")

_MOTION_FIELDS: Final = {
    "effort": Field(start=0, size=2, signed=True),
    "velocity": Field(start=2, size=4, signed=True),
    "position": Field(start=6, size=4, signed=True),
}
_ALL_FIELDS: Final = _MOTION_FIELDS | {
    "voltage": Field(start=10, size=2, signed=False),
    "temperature": Field(start=12, size=1, signed=False),
    "torque_enable": Field(start=13, size=1, signed=False),
    "hardware_error": Field(start=14, size=1, signed=False),
    "bus_watchdog": Field(start=15, size=1, signed=True),
}
_SOURCES: Final = (*range(126, 136), 144, 145, 146, 64, 70, 98)

DIRECT: Final = Block(address=126, size=10, fields=MappingProxyType(_MOTION_FIELDS))


def block_of(model: ServoDatasheet, firmware: int, layout: BlockLayout) -> Block:
    """Choose the block of a servo.

    Raises:
        ValueError: INDIRECT is asked for and the servo has too few slots.
    """
    bank = next(
        (b for b in model.indirect_banks(firmware) if b.slots >= len(_SOURCES)),
        None,
    )
    if layout is BlockLayout.DIRECT or (layout is BlockLayout.AUTO and bank is None):
        return DIRECT
    if bank is None:
        raise ValueError(
            f"{model.name} with firmware {firmware} has no {len(_SOURCES)} indirect slots; "
            "set the layout to direct or auto"
        )
    return Block(
        address=bank.data,
        size=len(_SOURCES),
        fields=MappingProxyType(_ALL_FIELDS),
        map_address=bank.addresses,
        sources=_SOURCES,
    )
