"""Describe one emulated servo and how the undocumented corners of its firmware behave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from drivers.dynamixel.tables.control_table import MODELS


class _Item(Protocol):
    @property
    def eeprom(self) -> bool: ...
    @property
    def minimum(self) -> int | None: ...
    @property
    def maximum(self) -> int | None: ...


class _Sheet(Protocol):
    @property
    def registers(self) -> Mapping[str, _Item]: ...


def check_ids(ids: Sequence[int]) -> None:
    """Check that a bus has servos, each with an id of its own.

    Raises:
        ValueError: there are none, or two of them share an id.
    """
    if not ids or len(set(ids)) < len(ids):
        raise ValueError(f"servo ids: expected one or more, all different, got {ids}")


def check_factory_values(
    servo_id: int, model_name: str, models: Mapping[str, _Sheet], eeprom: Mapping[str, int]
) -> None:
    """Check that a servo's model exists and that its EEPROM can hold these values.

    Raises:
        ValueError: the model or a register is unknown, a register is not in the EEPROM, or its
            value is out of range.
    """
    if model_name not in models:
        expected = ", ".join(models)
        raise ValueError(f"servo {servo_id}: model: expected one of {expected}; got {model_name}")
    registers = models[model_name].registers
    where = f"servo {servo_id} ({model_name}): eeprom"
    wrong = [name for name in eeprom if name not in registers or not registers[name].eeprom]
    if wrong:
        raise ValueError(f"{where}: not in its EEPROM: {wrong}")
    for name, value in eeprom.items():
        low, high = registers[name].minimum, registers[name].maximum
        if low is not None and high is not None and not low <= value <= high:
            raise ValueError(f"{where}: {name}: expected {low}..{high}, got {value}")


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatedServoSpec:
    """Say which servo sits on the bus; `eeprom` replaces factory values by register name.

    Raises:
        ValueError: the model or a register is unknown, a register is not in the EEPROM, or its
            value is out of range.
    """

    id: int
    model_name: str
    eeprom: Mapping[str, int] = field(default_factory=dict)
    firmware_version: int = 48

    def __post_init__(self) -> None:
        check_factory_values(self.id, self.model_name, MODELS, self.eeprom)


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareOptions:
    """Choose what the manual leaves open, and the constants of the protection.

    A servo counts as overloaded when its effort stays above `overload_ratio` of stall for
    `overload_time_s`. What heats and cools it: `sim_twin/servos/firmware/thermal.py`. `supply_ohm`
    is the resistance of supply, cables and connectors together (chosen, not measured).

    When the Bus Watchdog trips, the manual says only that the servo stops. By default its path
    stops where it is: it holds the setpoint it had. With `trip_holds_present` it takes its
    present position as goal, as DynamixelSDK issue 584 hints; under load it then sags until
    the position error carries the load. Which of the two a given firmware does must be measured.
    """

    watchdog_fed_by_any_packet: bool = False
    sync_read_stops_at_missing: bool = False
    trip_holds_present: bool = False
    reboot_s: float = 0.2
    brownout_v: float = 5.0
    overload_ratio: float = 0.8
    overload_time_s: float = 3.0
    ambient_c: float = 25.0
    supply_ohm: float = 0.05
