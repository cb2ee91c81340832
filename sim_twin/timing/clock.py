"""Make simulated time a clock: who waits on it moves the simulation."""

from typing import Protocol


class Simulation(Protocol):
    """Advance in fixed steps and tell its time."""

    @property
    def now_ns(self) -> int:
        """Return simulated time in nanoseconds."""
        ...

    def step(self) -> None:
        """Advance by one step."""
        ...


class SimClock:
    """Be the simulated time; `sleep_until` steps the simulation in lock-step with the caller."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def now_ns(self) -> int:
        """Return simulated time in nanoseconds."""
        return self._simulation.now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Step the simulation until it has reached `deadline_ns`."""
        while self._simulation.now_ns < deadline_ns:
            self._simulation.step()
