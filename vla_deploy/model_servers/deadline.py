"""Bound a call by one moment, whatever it is waiting for."""

from dataclasses import dataclass

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.errors import TimedOut


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """Hold when a call must have ended, and how long it was given."""

    clock: Clock
    end_ns: int
    given_s: float

    @classmethod
    def within(cls, clock: Clock, given_s: float) -> "Deadline":
        """Return the deadline `given_s` from now."""
        return cls(clock=clock, end_ns=clock.now_ns() + round(given_s * NS_PER_S), given_s=given_s)

    @property
    def left_s(self) -> float:
        """Return the time left, at least 0."""
        return max(0.0, (self.end_ns - self.clock.now_ns()) / NS_PER_S)

    def bound_s(self, wanted_s: float | None = None) -> float:
        """Return the time that one wait may take: what is wanted, at most what is left.

        Raises:
            TimedOut: nothing is left.
        """
        left_s = self.left_s
        if left_s <= 0.0:
            raise TimedOut(f"no whole answer within {self.given_s:g} s")
        return left_s if wanted_s is None else min(wanted_s, left_s)
