"""Move the base: on a ramp to the wheel drives, on the only way there is."""

from vla_deploy.control.base_motion import BaseLimits, BaseRamp, base_limits, permitted
from vla_deploy.control.wheels import Wheels
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import Verdict


class BaseOutput:
    """Hold the base's ramp, and command the wheels by it."""

    def __init__(self, robot: RobotDescription, wheels: Wheels) -> None:
        self._limits: BaseLimits = base_limits(robot)
        self._wheels = wheels
        self.ramp = BaseRamp(self._limits)

    def follow(self, wanted: tuple[float, float], verdict: Verdict, period_s: float) -> None:
        """Move towards what a verdict leaves of a wanted velocity."""
        v_m_s, w_rad_s = permitted(wanted, self._limits, verdict.speed_ratio, verdict.blocked)
        self._move(v_m_s, w_rad_s, period_s)

    def brake(self, period_s: float) -> None:
        """Move towards rest."""
        self._move(0.0, 0.0, period_s)

    def _move(self, v_m_s: float, w_rad_s: float, period_s: float) -> None:
        if self._wheels.enabled:
            self.ramp.advance(v_m_s, w_rad_s, period_s)
        else:
            self.ramp.halt()
        self._wheels.cycle(self.ramp.v_m_s, self.ramp.w_rad_s)
