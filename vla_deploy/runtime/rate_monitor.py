"""Measure how fast a node steps: of late, and while a profile is on trial."""

from typing import Final

from drivers.clock import NS_PER_S

_MIN_RATE_RATIO: Final = 0.8
_PACE_WEIGHT: Final = 0.01


class RateMonitor:
    """Measure which share of its steps a node makes: one that was slow before may stay so."""

    def __init__(self) -> None:
        self._periods_by_step = 1.0
        self._last_ns: int | None = None

    @property
    def ratio(self) -> float:
        """Return the share of its steps that the node makes, over about a hundred of them."""
        return min(1.0, 1.0 / self._periods_by_step)

    def note(self, now_ns: int, period_s: float) -> None:
        """Count a step."""
        if self._last_ns is not None:
            periods = (now_ns - self._last_ns) / (period_s * NS_PER_S)
            self._periods_by_step += _PACE_WEIGHT * (periods - self._periods_by_step)
        self._last_ns = now_ns


class TrialMonitor:
    """Count the steps that are made under a profile on trial, where `usual_hz` are to be had."""

    def __init__(self, change_id: int, began_ns: int, usual_hz: float) -> None:
        self.change_id = change_id
        self._began_ns = began_ns
        self._wanted_hz = _MIN_RATE_RATIO * usual_hz
        self._steps = 0

    def note(self) -> None:
        """Count a step."""
        self._steps += 1

    def again(self, now_ns: int) -> None:
        """Begin to count anew."""
        self._began_ns, self._steps = now_ns, 0

    def fault(self, now_ns: int, period_s: float) -> str:
        """Say how slow the steps are, nothing when they are fast enough."""
        rate_hz = self._steps / max((now_ns - self._began_ns) / NS_PER_S, period_s)
        if rate_hz >= self._wanted_hz:
            return ""
        return f"steps at {rate_hz:.1f} Hz, expected {self._wanted_hz:.1f} Hz"
