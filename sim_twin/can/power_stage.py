"""Model a wheel motor and its power stage: limits, back-EMF, supply, heat, encoder."""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final, Self

# No edge for this long reads as standstill.
EDGE_TIMEOUT_S: Final = 0.05
# A winding this little warmer than the room is cold: nothing about it changes any more.
AT_REST_K: Final = 0.01


class Trip(Enum):
    """Name what makes a drive protect itself."""

    UNDER_VOLTAGE = "DC link under-voltage"
    OVER_VOLTAGE = "DC link over-voltage"
    OVER_TEMPERATURE = "motor over-temperature"
    OVERLOAD = "continuous over-current"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorSpec:
    """Describe a gearless hub motor with its power stage on a 24 V supply.

    `overload_s` is how long the full current may flow, from cold, until the I²t guard trips.
    """

    torque_limit_nm: float = 4.0
    torque_nm_per_a: float = 0.5
    resistance_ohm: float = 0.6
    continuous_current_a: float = 4.5
    overload_s: float = 20.0
    heat_capacity_j_k: float = 100.0
    thermal_resistance_k_w: float = 6.0
    ambient_c: float = 25.0
    temperature_limit_c: float = 100.0
    temperature_hysteresis_c: float = 15.0
    supply_v: float = 24.0
    supply_resistance_ohm: float = 0.1
    logic_v: float = 8.0
    under_voltage_v: float = 16.0
    over_voltage_v: float = 32.0

    @property
    def current_limit_a(self) -> float:
        """Return the largest current that the power stage gives."""
        return self.torque_limit_nm / self.torque_nm_per_a

    def behind_gear(self, ratio: float) -> Self:
        """Return the faster motor that gives the wheel the same torque and speed by a gear."""
        return replace(
            self,
            torque_limit_nm=self.torque_limit_nm / ratio,
            torque_nm_per_a=self.torque_nm_per_a / ratio,
        )


class PowerStage:
    """Compute which torque is possible and what it costs in volts, heat and I²t."""

    def __init__(self, spec: MotorSpec) -> None:
        self.spec = spec
        self.supply_v = spec.supply_v
        self.bus_v = spec.supply_v
        self.bus_current_a = 0.0
        self.current_a = 0.0
        self.temperature_c = spec.ambient_c
        self.current_limit_a = spec.current_limit_a
        self.jammed = False
        self._i2t_a2s = 0.0
        self._continuous_a2 = spec.continuous_current_a**2
        self._i2t_limit_a2s = spec.overload_s * (spec.current_limit_a**2 - self._continuous_a2)
        self._hot = False
        self.at_rest = True
        self.is_strained = False
        """Whether `trip` may find something; it cannot otherwise."""
        self._cool_c = spec.temperature_limit_c - spec.temperature_hysteresis_c
        self._bound_torque()

    def limit_current(self, current_a: float) -> None:
        """Give at most this current, which is at most the motor's."""
        self.current_limit_a = min(max(current_a, 0.0), self.spec.current_limit_a)
        self._bound_torque()

    def _bound_torque(self) -> None:
        """Find up to which speed the full current flows: every step asks for it."""
        spec, limit_a = self.spec, self.current_limit_a
        limit_nm = limit_a * spec.torque_nm_per_a
        self._full_torque_nm = -limit_nm, limit_nm
        headroom_v = self.bus_v - limit_a * spec.resistance_ohm
        self._full_torque_rad_s = headroom_v / spec.torque_nm_per_a

    def torque_range_nm(self, velocity_rad_s: float) -> tuple[float, float]:
        """Return the torques that current limit and back-EMF allow, the lowest first."""
        if abs(velocity_rad_s) <= self._full_torque_rad_s:
            return self._full_torque_nm
        spec, limit_a = self.spec, self.current_limit_a
        emf_v = spec.torque_nm_per_a * velocity_rad_s
        low_a = min(max((-self.bus_v - emf_v) / spec.resistance_ohm, -limit_a), limit_a)
        high_a = max(min((self.bus_v - emf_v) / spec.resistance_ohm, limit_a), -limit_a)
        return low_a * spec.torque_nm_per_a, high_a * spec.torque_nm_per_a

    def load(self, torque_nm: float, velocity_rad_s: float, dt_s: float) -> None:
        """Let a torque act for `dt_s`: the supply sags, the winding heats or cools."""
        spec = self.spec
        self.current_a = current_a = torque_nm / spec.torque_nm_per_a
        copper_w = spec.resistance_ohm * current_a * current_a
        power_w = copper_w + torque_nm * velocity_rad_s
        self.bus_current_a = power_w / self.bus_v if self.bus_v > 1.0 else power_w
        self.bus_v = bus_v = self.supply_v - spec.supply_resistance_ohm * self.bus_current_a
        cooling_w = (self.temperature_c - spec.ambient_c) / spec.thermal_resistance_k_w
        self.temperature_c += (copper_w - cooling_w) / spec.heat_capacity_j_k * dt_s
        self._bound_torque()
        felt_a = spec.current_limit_a if self.jammed else current_a
        i2t_a2s = self._i2t_a2s + (felt_a * felt_a - self._continuous_a2) * dt_s
        self._i2t_a2s = i2t_a2s = i2t_a2s if i2t_a2s > 0.0 else 0.0
        warm = self.temperature_c - spec.ambient_c > AT_REST_K
        self.at_rest = not (torque_nm or warm or i2t_a2s or self.jammed)
        self.is_strained = not (
            self.temperature_c <= self._cool_c
            and spec.under_voltage_v <= bus_v <= spec.over_voltage_v
            and i2t_a2s <= self._i2t_limit_a2s
        )

    def supply(self, volts: float) -> None:
        """Change the supply's voltage."""
        self.supply_v = self.bus_v = volts
        self._bound_torque()
        self.is_strained = True

    def trip(self, armed: bool) -> Trip | None:
        """Return what forbids torque now; voltage and I²t count only where power is `armed`."""
        spec = self.spec
        limit_c = spec.temperature_limit_c - self._hot * spec.temperature_hysteresis_c
        self._hot = self.temperature_c > limit_c
        if self._hot:
            return Trip.OVER_TEMPERATURE
        if not armed:
            return None
        if self.bus_v < spec.under_voltage_v:
            return Trip.UNDER_VOLTAGE
        if self.bus_v > spec.over_voltage_v:
            return Trip.OVER_VOLTAGE
        return Trip.OVERLOAD if self._i2t_a2s > self._i2t_limit_a2s else None

    def overheat(self) -> None:
        """Heat the winding beyond its limit; it cools down by itself."""
        spec = self.spec
        self.temperature_c = spec.temperature_limit_c + spec.temperature_hysteresis_c
        self.at_rest = False
        self.is_strained = True

    def jam(self, on: bool) -> None:
        """Let the I²t guard feel the full current, whatever flows."""
        self.jammed = on
        self.at_rest = False

    def forget_load(self) -> None:
        """Clear what the firmware keeps in memory, as a reset does; the heat stays."""
        self._i2t_a2s = 0.0
        self.limit_current(self.spec.current_limit_a)


class ShaftEncoder:
    """Count whole steps since power-on; the velocity comes from the time between their edges."""

    def __init__(self, counts_per_rev: int) -> None:
        self.counts_per_rev = counts_per_rev
        self.counts_per_rad = counts_per_rev / math.tau
        self.frozen = False
        self._position_rad = 0.0
        self._velocity_rad_s = 0.0
        self._zero_rad: float | None = None

    def lose_supply(self) -> None:
        """Forget the count."""
        self._zero_rad = None
        self.frozen = False

    def measure(self, position_rad: float, velocity_rad_s: float) -> None:
        """Take the shaft's angle and speed."""
        if self._zero_rad is None:
            self._zero_rad = position_rad
        if not self.frozen:
            self._position_rad = position_rad
            self._velocity_rad_s = velocity_rad_s

    @property
    def travelled(self) -> int:
        """Return the whole steps since power-on."""
        return round((self._position_rad - (self._zero_rad or 0.0)) * self.counts_per_rad)

    @property
    def counts_s(self) -> float:
        """Return the velocity in counts per second."""
        counts_s = self._velocity_rad_s * self.counts_per_rad
        return counts_s if abs(counts_s) * EDGE_TIMEOUT_S >= 1.0 else 0.0
