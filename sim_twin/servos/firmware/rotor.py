"""Turn free shafts by their motors' duty, where no physics engine does it."""

from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from sim_twin.servos.firmware.profile import Floats

TIME_CONSTANT_S: Final = 0.02
"""In which a gear motor without load takes on its speed (chosen: such motors have 10 to 30 ms)."""


class MotorFigures(Protocol):
    """Declare what a datasheet of any family says of its motor, at `voltage_v`."""

    @property
    def name(self) -> str:
        """Return the model's name."""
        ...

    @property
    def stall_torque_nm(self) -> float:
        """Return the torque at standstill with full duty."""
        ...

    @property
    def stall_current_a(self) -> float:
        """Return the current at standstill with full duty."""
        ...

    @property
    def no_load_speed_rad_s(self) -> float:
        """Return the speed with full duty and no load."""
        ...

    @property
    def voltage_v(self) -> float:
        """Return the nominal voltage."""
        ...


class FreeRotors:
    """Integrate one inertia per motor; the speed implicitly, so that any step is stable.

    torque = stall * duty - stall / no_load * velocity

    Without `inertia_kg_m2` each motor turns its own rotor alone, by `TIME_CONSTANT_S`: an inertia
    that suits a strong motor makes the position loop of a fast weak one unstable. A shaft ends at
    its `stops_rad`, a row of the lowest and one of the highest positions, without a bounce.
    """

    def __init__(self, models: Sequence[MotorFigures], inertia_kg_m2: float | None = None) -> None:
        self._stall_nm = np.array([model.stall_torque_nm for model in models])
        self._damping = self._stall_nm / np.array([model.no_load_speed_rad_s for model in models])
        own_kg_m2 = TIME_CONSTANT_S * self._damping
        self._inertia_kg_m2 = own_kg_m2 if inertia_kg_m2 is None else inertia_kg_m2
        self.motion: Floats = np.zeros((2, len(models)))
        self.position_rad, self.velocity_rad_s = self.motion
        self.torque_nm: Floats = np.zeros(len(models))
        self.stops_rad: Floats = np.full((2, len(models)), np.inf)
        self.stops_rad[0] = -np.inf

    def advance(self, duty: Floats, dt_s: float) -> None:
        """Move on by `dt_s` with a constant duty."""
        per_inertia = dt_s / self._inertia_kg_m2
        pushed = self.velocity_rad_s + per_inertia * self._stall_nm * duty
        self.velocity_rad_s[:] = pushed / (1.0 + per_inertia * self._damping)
        turned = self.position_rad + self.velocity_rad_s * dt_s
        low, high = self.stops_rad
        self.velocity_rad_s[(turned < low) | (turned > high)] = 0.0
        self.position_rad[:] = np.clip(turned, low, high)
        self.torque_nm = self._stall_nm * duty - self._damping * self.velocity_rad_s
