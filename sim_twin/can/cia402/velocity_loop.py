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

    def __init__(self, kv: float, ki: float) -> None:
        self.kv = kv
        self.ki = ki
        self._integral_nm = 0.0
        self.saturated = False

    def reset(self) -> None:
        """Forget the integral; done whenever the power is off."""
        self._integral_nm = 0.0
        self.saturated = False

    def torque_nm(
        self, error_rad_s: float, dt_s: float, low_nm: float, high_nm: float, ahead_nm: float = 0.0
    ) -> float:
        """Return the torque for the next `dt_s` within what is possible."""
        wanted_nm = self.kv * error_rad_s + self._integral_nm + ahead_nm
        if low_nm <= wanted_nm <= high_nm:
            self.saturated = False
            self._integral_nm += self.ki * error_rad_s * dt_s
            return wanted_nm
        self.saturated = True
        return min(max(wanted_nm, low_nm), high_nm)
