"""Let the supply's voltage fall with the current that the motors draw."""

from collections.abc import Sequence

import numpy as np

from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.rotor import MotorFigures


class Rail:
    """Be the power lines of one bus: an ideal supply behind a resistance.

    A motor's current is stall * (duty * volts / nominal - speed / no-load speed), and an ideal
    bridge draws duty times that from the rail. Current that motors return is lost: it does not
    raise the voltage.
    """

    def __init__(self, models: Sequence[MotorFigures], resistance_ohm: float) -> None:
        self._resistance_ohm = resistance_ohm
        stall_a = np.array([model.stall_current_a for model in models])
        self.supply_w = 0.0
        """What the motors drew when the voltage was last asked for."""
        self._per_volt = np.array([1.0 / model.voltage_v for model in models])
        self._a_per_volt = stall_a * self._per_volt
        self._a_per_rad_s = np.array(
            [model.stall_current_a / model.no_load_speed_rad_s for model in models]
        )

    def volts(self, supply_v: float, duty: Floats, velocity_rad_s: Floats) -> float:
        """Return the voltage at the servos, where current and voltage agree."""
        back_a = float(duty.dot(velocity_rad_s * self._a_per_rad_s))
        per_volt_a = float(duty.dot(duty * self._a_per_volt))
        ohm = self._resistance_ohm
        volts = min(supply_v, max(0.0, (supply_v + ohm * back_a) / (1.0 + ohm * per_volt_a)))
        self.supply_w = supply_v * max(0.0, per_volt_a * volts - back_a)
        return volts

    def nominal_ratio(self, volts: float) -> Floats:
        """Return a voltage as a share of each motor's nominal one."""
        return self._per_volt * volts
