"""Tell how fast the wheels turn by their encoders' counts, beside how fast they were told to."""

from collections import deque
from collections.abc import Sequence

from drivers.clock import NS_PER_S

WINDOW_NS = NS_PER_S // 10


class WheelTracking:
    """Average both speeds over the last tenth of a second in which the drives have followed.

    A drive's own word for its speed does not count here: one that repeats itself would agree with
    a constant command for ever. Plain numbers: for two wheels an array costs several times as much.
    """

    def __init__(self, wheel_count: int) -> None:
        self._nothing = [0.0] * wheel_count
        self.forget()

    def forget(self) -> None:
        """Start over: the drives do not follow, or their counters began anew."""
        self.commanded_rad_s = self.measured_rad_s = self._nothing
        self._due_rad = self._nothing
        self._past: deque[tuple[int, list[float], Sequence[float]]] = deque()

    def note(
        self, now_ns: int, commanded_rad_s: Sequence[float], position_rad: Sequence[float]
    ) -> None:
        """Take in what one tick has commanded and where the wheels are."""
        past = self._past
        if past:
            step_s = (now_ns - past[-1][0]) / NS_PER_S
            due = zip(self._due_rad, commanded_rad_s, strict=True)
            self._due_rad = [due_rad + speed * step_s for due_rad, speed in due]
        past.append((now_ns, self._due_rad, position_rad))
        if now_ns - past[0][0] < WINDOW_NS:
            return
        while now_ns - past[1][0] >= WINDOW_NS:
            past.popleft()
        then_ns, then_due_rad, then_rad = past[0]
        elapsed_s = (now_ns - then_ns) / NS_PER_S
        self.commanded_rad_s = _mean_rates(then_due_rad, self._due_rad, elapsed_s)
        self.measured_rad_s = _mean_rates(then_rad, position_rad, elapsed_s)


def _mean_rates(before: Sequence[float], after: Sequence[float], elapsed_s: float) -> list[float]:
    return [(new - old) / elapsed_s for old, new in zip(before, after, strict=True)]
