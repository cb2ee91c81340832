"""Describe one emulated FEETECH servo and how the unknown corners of its firmware behave."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.feetech.codec import FEETECH_MAX_ID
from drivers.feetech.table import FEETECH_MODELS, FeetechDatasheet
from sim_twin.servos.spec import check_factory_values


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatedFeetechSpec:
    """Say which servo sits on the bus; `eeprom` replaces factory values by register name.

    Raises:
        ValueError: the id, the model or a register is unknown, a register is not in the EEPROM, or
            its value is out of range.
    """

    id: int
    model_name: str
    eeprom: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 <= self.id <= FEETECH_MAX_ID:
            raise ValueError(f"servo {self.id}: id: expected 0..{FEETECH_MAX_ID}")
        check_factory_values(self.id, self.model_name, FEETECH_MODELS, self.eeprom)

    @property
    def datasheet(self) -> FeetechDatasheet:
        """Return the model's datasheet."""
        return FEETECH_MODELS[self.model_name]


@dataclass(frozen=True, slots=True, kw_only=True)
class FeetechOptions:
    """Choose what no source says.

    Users report that only loss of power ends an overload, and a reboot counts as one here. With
    `torque_off_clears_overload` a 0 written to torque_enable ends it, and an over-current, too.
    `supply_ohm` is the resistance of supply, cables and connectors together (chosen, not measured).
    """

    torque_off_clears_overload: bool = False
    reboot_s: float = 0.8
    brownout_v: float = 3.5
    ambient_c: float = 25.0
    supply_ohm: float = 0.05
