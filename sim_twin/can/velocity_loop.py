"""Turn a velocity demand into motor torque: the drive's ramp generator and PI controller."""


def ramp_towards(present: float, target: float, up: float, down: float) -> float:
    """Move `present` towards `target` by at most `up` away from zero or `down` towards it."""
    speeding_up = abs(target) > abs(present) and target * present >= 0.0
    step = up if speeding_up else down
    if abs(target - present) <= step:
        return target
    return present + (step if target > present else -step)


class VelocityLoop:
    """Control velocity with a PI law; the integrator stops where the torque saturates."""

    def __init__(self, kv: float, ki: float, torque_limit_nm: float) -> None:
        self._kv = kv
        self._ki = ki
        self._limit_nm = torque_limit_nm
        self._integral_nm = 0.0
        self.saturated = False

    def reset(self) -> None:
        """Forget the integral; done whenever the power is off."""
        self._integral_nm = 0.0
        self.saturated = False

    def torque_nm(self, demand_rad_s: float, velocity_rad_s: float, dt_s: float) -> float:
        """Return the torque for the next `dt_s`."""
        error = demand_rad_s - velocity_rad_s
        wanted_nm = self._kv * error + self._integral_nm
        torque_nm = min(max(wanted_nm, -self._limit_nm), self._limit_nm)
        self.saturated = torque_nm != wanted_nm
        if not self.saturated:
            self._integral_nm += self._ki * error * dt_s
        return torque_nm
