"""Give a bus its voltage: steady, or on a ramp to another one."""

from drivers.clock import NS_PER_S

NOMINAL_V = 12.0


class Supply:
    """Hold a supply voltage that may move in time."""

    def __init__(self, volts: float = NOMINAL_V) -> None:
        self.usual_v = volts
        """What it gives where nothing disturbs it."""
        self._from_v = self._to_v = volts
        self._start_ns = self._end_ns = 0

    def feed(self, volts: float) -> None:
        """Give another voltage from now on, or after what disturbs it now."""
        if self._to_v == self.usual_v:
            self._to_v = volts
        self.usual_v = volts

    def ramp_to(self, volts: float, now_ns: int, over_s: float = 0.0) -> None:
        """Move from the present voltage to another one."""
        self._from_v, self._to_v = self.volts(now_ns), volts
        self._start_ns, self._end_ns = now_ns, now_ns + round(over_s * NS_PER_S)

    def volts(self, now_ns: int) -> float:
        """Return the voltage at a moment that is not before the last ramp's start."""
        if now_ns >= self._end_ns:
            return self._to_v
        share = (now_ns - self._start_ns) / (self._end_ns - self._start_ns)
        return self._from_v + share * (self._to_v - self._from_v)
