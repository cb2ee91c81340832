"""Say when a fault is on: from when, for how long, and in which rhythm where it comes and goes."""

import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTiming:
    """Describe a fault's course from the moment of its injection; no duration means for ever.

    With a period the fault comes and goes: on for `duty_ratio` of each period, or, where a
    `probability` is given, on for a whole period or not at all, as the seed draws it.
    """

    start_s: float = 0.0
    duration_s: float | None = None
    period_s: float | None = None
    duty_ratio: float = 0.5
    probability: float | None = None
    seed: int = 0

    def is_on(self, elapsed_s: float) -> bool:
        """Return whether the fault is on, this long after the injection."""
        since_s = elapsed_s - self.start_s
        if since_s < 0.0 or self.is_over(elapsed_s):
            return False
        if self.period_s is None:
            return True
        period, into_s = divmod(since_s, self.period_s)
        if self.probability is None:
            return into_s < self.duty_ratio * self.period_s
        return random.Random(f"{self.seed} {period}").random() < self.probability

    def is_over(self, elapsed_s: float) -> bool:
        """Return whether the fault will not come back."""
        return self.duration_s is not None and elapsed_s >= self.start_s + self.duration_s
