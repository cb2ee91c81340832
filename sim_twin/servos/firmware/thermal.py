"""Heat the servos with the square of their current: winding to body, body to air.

The winding takes stall voltage x stall current x effort squared. Masses and sizes are those of the
ROBOTIS e-manual (specifications of each model). The other constants are chosen, not measured:

- a body stores 0.8 J per gram and kelvin, as aluminium (0.9), steel (0.5) and plastics (1.5) do
  together, a tenth of it in the winding;
- the winding follows the body with a time constant of 15 s;
- the surface gives 12 W per square metre and kelvin to still air, by convection and radiation.

The thermometer sits on the board, so Present Temperature is the body's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import Final

import numpy as np

from sim_twin.servos.firmware.profile import Floats
from sim_twin.servos.firmware.rotor import MotorFigures

SPECIFIC_HEAT_J_G_K: Final = 0.8
WINDING_SHARE: Final = 0.1
WINDING_TIME_CONSTANT_S: Final = 15.0
SURFACE_W_M2_K: Final = 12.0

_X330_MM: Final = (20.0, 34.0, 26.0)
_X430_MM: Final = (28.5, 46.5, 34.0)
_X540_MM: Final = (33.5, 58.5, 44.0)
_HALF_2X430_MM: Final = (18.0, 46.5, 36.0)


@dataclass(frozen=True, slots=True)
class ThermalBody:
    """Hold what a servo weighs and measures; of a double servo, one half."""

    mass_g: float
    size_mm: tuple[float, float, float]

    @property
    def heat_capacity_j_k(self) -> float:
        """Return how much heat warms winding and body together by one kelvin."""
        return self.mass_g * SPECIFIC_HEAT_J_G_K

    @property
    def cooling_w_k(self) -> float:
        """Return how much heat goes to the air per kelvin above it."""
        faces_mm2 = sum(a * b for a, b in combinations(self.size_mm, 2))
        return 2.0 * faces_mm2 * 1e-6 * SURFACE_W_M2_K


BODIES: Final[Mapping[str, ThermalBody]] = MappingProxyType(
    {
        "XL330": ThermalBody(18.0, _X330_MM),
        "XC330": ThermalBody(23.0, _X330_MM),
        "XL430": ThermalBody(57.2, _X430_MM),
        "XC430": ThermalBody(65.0, _X430_MM),
        "XM430": ThermalBody(82.0, _X430_MM),
        "XH430": ThermalBody(82.0, _X430_MM),
        "2XL430": ThermalBody(98.5 / 2, _HALF_2X430_MM),
        "2XC430": ThermalBody(98.5 / 2, _HALF_2X430_MM),
        "XM540": ThermalBody(165.0, _X540_MM),
        "XH540": ThermalBody(165.0, _X540_MM),
    }
)
"""Bodies by the model's name up to its gear ratio."""


def body_of(model: MotorFigures) -> ThermalBody:
    """Return the body of a Dynamixel model."""
    return BODIES[model.name.partition("-")[0]]


class Thermals:
    """Follow the temperatures of all motors of a bus; without `bodies` of Dynamixel models."""

    def __init__(
        self,
        models: Sequence[MotorFigures],
        ambient_c: float,
        bodies: Sequence[ThermalBody] = (),
    ) -> None:
        bodies = bodies or [body_of(model) for model in models]
        capacity_j_k = np.array([body.heat_capacity_j_k for body in bodies])
        self._ambient_c = ambient_c
        self._stall_w = np.array([model.voltage_v * model.stall_current_a for model in models])
        self._winding_j_k = capacity_j_k * WINDING_SHARE
        self._body_j_k = capacity_j_k - self._winding_j_k
        self._bridge_w_k = self._winding_j_k / WINDING_TIME_CONSTANT_S
        self._cooling_w_k = np.array([body.cooling_w_k for body in bodies])
        self._celsius = np.full((2, len(models)), ambient_c)
        self.winding_c, self.body_c = self._celsius
        self._discretise(0.0)

    def _discretise(self, dt_s: float) -> None:
        """Write the exchange of heat over `dt_s` as factors: few operations on both rows at once.

        What a row keeps, what it takes from the other row, and what comes from outside.
        """
        self._dt_s = dt_s
        to_winding = self._bridge_w_k * dt_s / self._winding_j_k
        to_body = self._bridge_w_k * dt_s / self._body_j_k
        to_air = self._cooling_w_k * dt_s / self._body_j_k
        self._kept = np.stack([1.0 - to_winding, 1.0 - to_body - to_air])
        self._taken = np.stack([to_winding, to_body])
        self._gained = np.stack([0.0 * to_air, to_air * self._ambient_c])
        self._winding_k = self._stall_w * dt_s / self._winding_j_k

    def advance(self, effort_ratio: Floats, dt_s: float) -> None:
        """Let this share of the stall current flow for `dt_s`."""
        if dt_s != self._dt_s:
            self._discretise(dt_s)
        gained = self._gained
        np.multiply(effort_ratio, effort_ratio, out=gained[0])
        gained[0] *= self._winding_k
        taken = self._celsius[::-1] * self._taken
        self._celsius *= self._kept
        self._celsius += taken
        self._celsius += gained

    def heat(self, row: int, celsius: float) -> None:
        """Bring a motor to a temperature, as heat from outside does; it cools from there."""
        self.winding_c[row] = self.body_c[row] = celsius
