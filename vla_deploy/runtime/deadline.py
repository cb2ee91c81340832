"""Bound a call by one moment, whatever it is waiting for."""

from dataclasses import dataclass, replace
from threading import Event

from drivers.clock import NS_PER_S, Clock


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """Hold when a call must have ended, and how long it was given.

    Setting `recall` ends it at once: the answer is not wanted any more.
    """

    clock: Clock
    end_ns: int
    given_s: float
    recall: Event | None = None

    @classmethod
    def within(cls, clock: Clock, given_s: float, recall: Event | None = None) -> "Deadline":
        """Return the deadline `given_s` from now."""
        end_ns = clock.now_ns() + round(given_s * NS_PER_S)
        return cls(clock=clock, end_ns=end_ns, given_s=given_s, recall=recall)

    def share(self, parts: int) -> "Deadline":
        """Return the deadline of the next of so many equal parts of the time that is left."""
        given_s = self.left_s / parts
        end_ns = self.clock.now_ns() + round(given_s * NS_PER_S)
        return replace(self, end_ns=end_ns, given_s=given_s)

    def sooner(self, by_s: float) -> "Deadline":
        """Return a deadline that ends so much earlier: the time is for something else."""
        return replace(
            self, end_ns=self.end_ns - round(by_s * NS_PER_S), given_s=self.given_s - by_s
        )

    def call_in(self) -> None:
        """Set `recall`, where there is one: the answer is not wanted any more."""
        if self.recall is not None:
            self.recall.set()

    @property
    def is_recalled(self) -> bool:
        """Return whether the answer is not wanted any more."""
        return self.recall is not None and self.recall.is_set()

    @property
    def left_s(self) -> float:
        """Return the time left, at least 0."""
        if self.is_recalled:
            return 0.0
        return max(0.0, (self.end_ns - self.clock.now_ns()) / NS_PER_S)
