"""Tell how far each joint has gone between its last two samples, and how long that took."""

import numpy as np

from drivers.clock import NS_PER_S
from drivers.servo.state import BusState
from vla_deploy.control.motion.axes import Flags, Floats, all_of


class JointSteps:
    """Compare each new sample with the one before; a silent servo's next one spans its silence."""

    def __init__(self, count: int) -> None:
        self.step: Floats = np.zeros(count)
        self.time_s: Floats = np.zeros(count)
        self._position: Floats = np.full(count, np.nan)
        self._stamp_ns = np.zeros(count, dtype=np.int64)
        self._taken_ns = 0
        self._complete = False
        """Every joint's last sample is that of `_taken_ns`."""

    def take(self, state: BusState) -> None:
        """Take in what the bus has read, once per cycle."""
        is_new = state.stamp_ns != self._taken_ns
        if is_new and self._complete and all_of(state.valid):
            self._take_all(state)
        else:
            self._take_some(state, is_new)

    def _take_all(self, state: BusState) -> None:
        passed_s = (state.stamp_ns - self._taken_ns) / NS_PER_S
        self._taken_ns = state.stamp_ns
        self.step = state.position_rad - self._position
        self.time_s = np.full_like(self._position, passed_s)
        self._position = state.position_rad.copy()

    def _take_some(self, state: BusState, is_new: bool) -> None:
        if self._complete:
            self._stamp_ns.fill(self._taken_ns)
        new: Flags = state.valid & is_new
        known = new & np.isfinite(self._position)
        self._taken_ns = state.stamp_ns
        self._complete = all_of(known)
        passed_s = (state.stamp_ns - self._stamp_ns) / NS_PER_S
        self.step = np.where(known, state.position_rad - self._position, 0.0)
        self.time_s = np.where(known, passed_s, 0.0)
        self._position = np.where(new, state.position_rad, self._position)
        self._stamp_ns = np.where(new, state.stamp_ns, self._stamp_ns)
