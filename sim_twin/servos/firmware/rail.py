"""Let the supplies' voltage fall with the current that the motors draw."""

from collections.abc import Sequence

import numpy as np

from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.rotor import MotorFigures

SupplyVolts = float | tuple[float, ...]
"""What each supply of a bus gives without load; a number where there is one supply."""


class Rails:
    """Model the power lines of one bus: each supply is ideal behind a resistance of its own.

    A motor's current is stall * (duty * volts / nominal - speed / no-load speed), and an ideal
    bridge draws duty times that from its rail. Current that motors return is lost: it does not
    raise the voltage. `feeds` has the number of the supply of each motor, from 0; without it one
    feeds all.
    """

    def __init__(
        self,
        models: Sequence[MotorFigures],
        resistance_ohm: float,
        feeds: Sequence[int] | None = None,
    ) -> None:
        self._resistance_ohm = resistance_ohm
        self._feeds = np.zeros(len(models), np.intp) if feeds is None else np.array(feeds, np.intp)
        self._count = int(self._feeds.max()) + 1
        stall_a = np.array([model.stall_current_a for model in models])
        self.supply_w = 0.0
        """What the motors drew when the voltages were last asked for."""
        self._per_volt = np.array([1.0 / model.voltage_v for model in models])
        self._a_per_volt = stall_a * self._per_volt
        self._a_per_rad_s = np.array(
            [model.stall_current_a / model.no_load_speed_rad_s for model in models]
        )

    def volts(self, supply_v: SupplyVolts, duty: Floats, velocity_rad_s: Floats) -> Floats:
        """Return the voltage at each servo, where current and voltage agree."""
        back_a = self._summed(duty * velocity_rad_s * self._a_per_rad_s)
        per_volt_a = self._summed(duty * duty * self._a_per_volt)
        ohm, given_v = self._resistance_ohm, np.asarray(supply_v)
        loaded_v = np.maximum(0.0, (given_v + ohm * back_a) / (1.0 + ohm * per_volt_a))
        rail_v = np.minimum(given_v, loaded_v)
        self.supply_w = float((given_v * np.maximum(0.0, per_volt_a * rail_v - back_a)).sum())
        volts: Floats = rail_v[self._feeds]
        return volts

    def _summed(self, values: Floats) -> Floats:
        """Return the sums over the motors of each supply."""
        return np.bincount(self._feeds, values, self._count).astype(np.float64, copy=False)

    def nominal_ratio(self, volts: Floats) -> Floats:
        """Return voltages as shares of each motor's nominal one."""
        ratio: Floats = self._per_volt * volts
        return ratio
