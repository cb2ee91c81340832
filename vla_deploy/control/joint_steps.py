"""Tell how far each joint has gone between its last two samples, and how long that took."""

import numpy as np

from drivers.clock import NS_PER_S
from drivers.dynamixel import BusState
from vla_deploy.control.axes import Flags, Floats, all_of


class JointSteps:
    """Compare each new sample with the one before; a silent servo's next one spans its silence."""

    def __init__(self, count: int) -> None:
        self.step: Floats = np.zeros(count)
        self.time_s: Floats = np.zeros(count)
        self._position: Floats = np.full(count, np.nan)
        self._stamp_ns = np.zeros(count, dtype=np.int64)
        self._taken_ns = 0

    def take(self, state: BusState) -> None:
        """Take in what the bus has read, once per cycle."""
        new: Flags = state.valid & (state.stamp_ns != self._taken_ns)
        known = new & np.isfinite(self._position)
        self._taken_ns = state.stamp_ns
        passed_s = (state.stamp_ns - self._stamp_ns) / NS_PER_S
        if all_of(known):
            self.step = state.position_rad - self._position
            self.time_s = passed_s
            self._position = state.position_rad.copy()
            self._stamp_ns = np.full(len(known), state.stamp_ns, dtype=np.int64)
            return
        self.step = np.where(known, state.position_rad - self._position, 0.0)
        self.time_s = np.where(known, passed_s, 0.0)
        self._position = np.where(new, state.position_rad, self._position)
        self._stamp_ns = np.where(new, state.stamp_ns, self._stamp_ns)
