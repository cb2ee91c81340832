"""Turn ODrive inputs into motor torque: control and input modes, ramps, gains, limits."""

import math
from typing import Final

from drivers.odrive.codec import ControlMode, InputMode
from sim_twin.can.cia402.velocity_loop import VelocityLoop, ramp_towards
from sim_twin.can.power_stage import PowerStage

SUPPORTED: Final = frozenset(
    {
        (ControlMode.TORQUE, InputMode.PASSTHROUGH),
        (ControlMode.VELOCITY, InputMode.PASSTHROUGH),
        (ControlMode.VELOCITY, InputMode.VEL_RAMP),
        (ControlMode.POSITION, InputMode.PASSTHROUGH),
    }
)
DEFAULT_VELOCITY_LIMIT_REV_S: Final = 10.0
DEFAULT_RAMP_REV_S2: Final = 10.0
DEFAULT_POSITION_GAIN: Final = 20.0
# Beyond this share of its limit the axis disarms.
OVERSPEED_RATIO: Final = 1.2


class ODriveController:
    """Hold modes, inputs and gains in the protocol's units: rev, rev/s, N·m."""

    def __init__(
        self,
        stage: PowerStage,
        velocity_gain: float,
        integrator_gain: float,
        gear_ratio: float = 1.0,
    ) -> None:
        self._stage = stage
        self._default_limit_rev_s = DEFAULT_VELOCITY_LIMIT_REV_S * gear_ratio
        self._default_gains = velocity_gain, integrator_gain
        self._loop = VelocityLoop(velocity_gain, integrator_gain)
        self.reset()

    def reset(self) -> None:
        """Return to the defaults."""
        self._loop.kv, self._loop.ki = self._default_gains
        self.control_mode = ControlMode.VELOCITY
        self.input_mode = InputMode.PASSTHROUGH
        self.velocity_limit_rev_s = self._default_limit_rev_s
        self.ramp_rev_s2 = DEFAULT_RAMP_REV_S2
        self.position_gain = DEFAULT_POSITION_GAIN
        self.input_rev = 0.0
        self.input_rev_s = 0.0
        self.input_nm = 0.0
        self.target_nm = 0.0
        self._setpoint_rev_s = 0.0
        self._loop.reset()

    @property
    def supported(self) -> bool:
        """Return whether the emulation knows this pair of modes."""
        return (self.control_mode, self.input_mode) in SUPPORTED

    def set_gains(self, velocity_gain: float, integrator_gain: float) -> None:
        """Set the velocity loop's gains in N·m per rev/s, and that per second."""
        self._loop.kv, self._loop.ki = velocity_gain, integrator_gain

    def set_limits(self, velocity_rev_s: float, current_a: float) -> None:
        """Set both limits; the current's is at most what the power stage gives."""
        self.velocity_limit_rev_s = velocity_rev_s
        self._stage.limit_current(current_a)

    def arm(self, position_rev: float, velocity_rev_s: float) -> None:
        """Start from where the shaft is."""
        self._loop.reset()
        self.input_rev = position_rev
        self._setpoint_rev_s = velocity_rev_s

    def overspeed(self, velocity_rev_s: float) -> bool:
        """Return whether the shaft runs away."""
        return abs(velocity_rev_s) > self.velocity_limit_rev_s * OVERSPEED_RATIO

    def torque_nm(self, dt_s: float, position_rev: float, velocity_rev_s: float) -> float:
        """Return the torque for the next `dt_s`."""
        low_nm, high_nm = self._stage.torque_range_nm(velocity_rev_s * math.tau)
        if self.control_mode is ControlMode.TORQUE:
            self.target_nm = min(max(self.input_nm, low_nm), high_nm)
            return self.target_nm
        limit_rev_s = self.velocity_limit_rev_s
        wanted_rev_s = min(max(self._wanted_rev_s(dt_s, position_rev), -limit_rev_s), limit_rev_s)
        self.target_nm = self._loop.torque_nm(
            wanted_rev_s - velocity_rev_s, dt_s, low_nm, high_nm, self.input_nm
        )
        return self.target_nm

    def _wanted_rev_s(self, dt_s: float, position_rev: float) -> float:
        if self.control_mode is ControlMode.POSITION:
            return self.position_gain * (self.input_rev - position_rev) + self.input_rev_s
        if self.input_mode is InputMode.VEL_RAMP:
            step = self.ramp_rev_s2 * dt_s
            self._setpoint_rev_s = ramp_towards(self._setpoint_rev_s, self.input_rev_s, step, step)
            return self._setpoint_rev_s
        return self.input_rev_s
