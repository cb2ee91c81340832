"""Move the base: on a ramp to the wheel drives, on the only way there is."""

from vla_deploy.control.motion.base_motion import BaseLimits, BaseRamp, base_limits, permitted
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import Reaction, Verdict


class BaseOutput:
    """Hold the base's ramp, and command the wheels by it."""

    def __init__(self, robot: RobotDescription, wheels: BaseDrive) -> None:
        self._limits: BaseLimits = base_limits(robot)
        self._wheels = wheels
        self.ramp = BaseRamp(self._limits)

    def follow(self, wanted: BaseVelocity, verdict: Verdict, period_s: float) -> None:
        """Move towards what a verdict leaves of a wanted velocity; brake where it demands that."""
        if verdict.reaction is Reaction.BASE_RAMP or not self._wheels.has_wheels:
            self.brake(period_s)
            return
        allowed = permitted(wanted, self._limits, verdict.speed_ratio, verdict.blocked)
        allowed = self._wheels.within(allowed)
        if self._wheels.enabled:
            self.ramp.advance(allowed.v_m_s, allowed.w_rad_s, period_s, allowed.left_m_s)
        self._command()

    def brake(self, period_s: float) -> None:
        """Move towards rest."""
        if self._wheels.enabled:
            self.ramp.brake(period_s)
        self._command()

    def _command(self) -> None:
        if not self._wheels.enabled:
            self.ramp.halt()
        self._wheels.cycle(*self.ramp.velocity)
