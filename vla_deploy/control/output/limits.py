"""Limit what leaves for the joints: the only exit from plans to the servo buses."""

import numpy as np

from vla_deploy.control.motion.axes import Flags, Floats, any_of

# A plan that keeps its velocity limit passes untouched, also over a tick that came late.
_STEP_SLACK = 1.25


class SetpointGate:
    """Clamp setpoints to each joint's range and to the step its velocity allows.

    A joint that starts outside its range, pushed there by hand, may stay or come back, but not go
    further out: arming must not move it.
    """

    def __init__(self, lower: Floats, upper: Floats, velocity: Floats) -> None:
        self._lower = lower
        self._upper = upper
        self._velocity = velocity * _STEP_SLACK
        self.sent = np.zeros_like(lower)
        self._clamped = np.zeros(len(lower), dtype=np.bool_)

    @property
    def clamped(self) -> bool:
        """Return whether the last setpoints had to be changed."""
        return bool(self._clamped.any())

    def place(self, position: Floats, joints: Flags) -> None:
        """Start some joints from their measured position, without a step."""
        self.sent = np.where(joints, position, self.sent)

    def limit(self, setpoint: Floats, period_s: float) -> Floats:
        """Return the setpoints that may be sent; NaN keeps the last one."""
        if not any_of(setpoint != self.sent):
            self._clamped[:] = False
            return self.sent
        step = self._velocity * period_s
        unknown = np.isnan(setpoint)
        wanted = np.where(unknown, self.sent, setpoint) if any_of(unknown) else setpoint
        low = np.maximum(self.sent - step, np.minimum(self._lower, self.sent))
        high = np.minimum(self.sent + step, np.maximum(self._upper, self.sent))
        self.sent = np.minimum(np.maximum(wanted, low), high)
        np.not_equal(self.sent, wanted, out=self._clamped)
        return self.sent
