"""Describe one row of the fault table: what a fault does to one kind of device, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim_twin.twin import Twin


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultParameter:
    """Declare how bad a fault may be made; the unit is part of the name, as in `volts_v`."""

    name: str
    default: float
    low: float
    high: float
    meaning: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Say what a fault befalls: `number` is a servo's or a drive's id, 0 for all else."""

    twin: Twin
    number: int
    values: Mapping[str, float]
    seed: int


Ending = Callable[[], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Begin a fault on a target; what `begin` returns ends it and leaves nothing behind."""

    summary: str
    begin: Callable[[Target], Ending]
    parameters: tuple[FaultParameter, ...] = ()
