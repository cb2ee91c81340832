"""Describe one emulated servo and how the undocumented corners of its firmware behave."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.dynamixel.tables.control_table import MODELS


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
        if self.model_name not in MODELS:
            expected = ", ".join(MODELS)
            raise ValueError(
                f"servo {self.id}: model: expected one of {expected}; got {self.model_name}"
            )
        registers = MODELS[self.model_name].registers
        wrong = [n for n in self.eeprom if n not in registers or not registers[n].eeprom]
        if wrong:
            raise ValueError(
                f"servo {self.id} ({self.model_name}): eeprom: not in its EEPROM: {wrong}"
            )
        for name, value in self.eeprom.items():
            low, high = registers[name].minimum, registers[name].maximum
            if low is not None and high is not None and not low <= value <= high:
                raise ValueError(
                    f"servo {self.id} ({self.model_name}): eeprom: {name}: expected {low}..{high}, "
                    f"got {value}"
                )


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
