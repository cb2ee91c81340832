"""Hold what is known of all servos of a bus, on the joint side."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.servo.hardware_error import HardwareError
from drivers.servo.joint_servo import JointServo

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
SILENT_S: Final = 0.05
"""A servo whose values are older has missed goals: it gets none, and begins where it is found."""
_ROWS: Final = ("position_rad", "velocity_rad_s", "effort_ratio", "voltage_v", "temperature_c")
_READINGS: Final = len(_ROWS)


@dataclass(slots=True, eq=False)
class BusState:
    """Hold arrays in the order of the servos; the bus overwrites them in every cycle.

    The first group comes with each cycle's block read. A servo that gave no value keeps its last
    one: then `valid` is False and `age_s` grows (infinite before the first value). The second group
    comes with it where the block holds it (`Layout.INDIRECT`); else it is polled a servo at a time,
    and known in part since the handshake. NaN means not read yet.
    """

    readings: Floats
    """Rows: position, velocity, effort, voltage, temperature; those below are views of it."""

    position_rad: Floats
    velocity_rad_s: Floats
    effort_ratio: Floats
    """Present current over stall current, or present load; signed like the joint."""
    age_s: Floats
    valid: Bools
    alert: Bools
    """The servo reports a hardware error; `error` follows in the same cycle or the next ones."""

    error: NDArray[np.uint8]
    """Bits of `HardwareError`."""
    torque_on: Bools
    watchdog: NDArray[np.int16]
    """bus_watchdog (98) of a Dynamixel: 0 off, 1..127 armed in units of 20 ms, -1 tripped.

    Of servos without one: 1 where this bus made them hold, else 0.
    """
    voltage_v: Floats
    temperature_c: Floats
    climate_stamp_ns: NDArray[np.int64]
    """When voltage and temperature of a polled servo came; -1 where they come with the block."""

    stamp_ns: int = 0

    @classmethod
    def of(cls, count: int) -> "BusState":
        """Return the state of `count` servos of which nothing is known."""
        readings = np.full((_READINGS, count), np.nan)
        return cls(
            readings=readings,
            position_rad=readings[0],
            velocity_rad_s=readings[1],
            effort_ratio=readings[2],
            voltage_v=readings[3],
            temperature_c=readings[4],
            climate_stamp_ns=np.full(count, -1, dtype=np.int64),
            age_s=np.full(count, np.inf),
            valid=np.zeros(count, dtype=np.bool_),
            alert=np.zeros(count, dtype=np.bool_),
            error=np.zeros(count, dtype=np.uint8),
            torque_on=np.zeros(count, dtype=np.bool_),
            watchdog=np.zeros(count, dtype=np.int16),
        )

    def part(self, rows: slice) -> "BusState":
        """Return the state of some servos, which goes on showing what this one holds.

        But for `stamp_ns`, which is a copy.
        """
        readings = self.readings[:, rows]
        arrays = {
            field.name: getattr(self, field.name)[rows]
            for field in fields(self)
            if field.name not in (*_ROWS, "readings", "stamp_ns")
        }
        shown = dict(zip(_ROWS, readings, strict=True))
        return BusState(readings=readings, stamp_ns=self.stamp_ns, **shown, **arrays)

    def copy(self) -> "BusState":
        """Return a state that the next cycle does not change."""
        copied = BusState.of(len(self.valid))
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "stamp_ns":
                copied.stamp_ns = value
            else:
                getattr(copied, field.name)[:] = value
        return copied

    def faults(self, servos: Sequence[JointServo]) -> list[str]:
        """Return a line for each servo that reports a hardware error."""
        return [
            f"{servo}: {hardware_error_text(int(bits))}"
            for servo, bits in zip(servos, self.error, strict=True)
            if bits
        ]


def hardware_error_text(bits: int) -> str:
    """Return hardware error bits in words."""
    return ", ".join((bit.name or "").lower().replace("_", " ") for bit in HardwareError(bits))
