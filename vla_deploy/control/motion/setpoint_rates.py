"""Tell how fast the setpoints move and how that changes, from their differences."""

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.control.motion.axes import Floats

_LONGEST_STEP_S = 0.1


class SetpointRates:
    """Remember the last setpoints and their velocity; after a pause both rates begin at zero."""

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._setpoint: Floats = np.zeros(0)
        self._velocity: Floats = np.zeros(0)

    def rates(self, now_ns: int, setpoint: Floats) -> tuple[Floats, Floats]:
        """Return velocity and acceleration since the last call."""
        step_s = np.inf if self._stamp_ns is None else (now_ns - self._stamp_ns) / NS_PER_S
        still = np.zeros_like(setpoint)
        if not 0.0 < step_s <= _LONGEST_STEP_S:
            velocity, acceleration = still, still
        else:
            velocity = (setpoint - self._setpoint) / step_s
            acceleration = (velocity - self._velocity) / step_s
        self._stamp_ns, self._setpoint, self._velocity = now_ns, setpoint.copy(), velocity
        return velocity, acceleration
