"""Judge devices by how many failures they had of late: ok, degraded, lost.

A state gets worse as soon as its count is reached within the window. It gets better only when the
count has fallen to `recover_at`, so that a device at the brink does not flicker.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Final

from drivers.clock import NS_PER_S


class BudgetState(IntEnum):
    """Name what a budget says of its device; a larger value is worse."""

    OK = 0
    DEGRADED = 1
    LOST = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetLimits:
    """Say how many failures within the window make a device degraded or lost.

    Raises:
        ValueError: the counts are not 0 <= recover_at < degraded_at <= lost_at, or no window.
    """

    window_s: float
    degraded_at: int
    lost_at: int
    recover_at: int = 0

    def __post_init__(self) -> None:
        if self.window_s <= 0.0:
            raise ValueError(f"error budget: window_s must be positive, got {self.window_s}")
        if not 0 <= self.recover_at < self.degraded_at <= self.lost_at:
            raise ValueError(
                "error budget: expected 0 <= recover_at < degraded_at <= lost_at, got "
                f"{self.recover_at}, {self.degraded_at}, {self.lost_at}"
            )


SERVO_LIMITS: Final = BudgetLimits(window_s=1.0, degraded_at=3, lost_at=25, recover_at=1)
"""For one servo or CAN node: at 250 Hz, 1 % of a second's answers degrade, 10 % lose it."""
BUS_LIMITS: Final = BudgetLimits(window_s=1.0, degraded_at=5, lost_at=50, recover_at=1)


class ErrorBudget:
    """Count the failures of one device in a sliding window; nothing is allocated afterwards.

    Only the newest `lost_at` failures are kept: more cannot make the state worse.
    """

    def __init__(self, limits: BudgetLimits) -> None:
        self.limits = limits
        self.count = 0
        self._window_ns = round(limits.window_s * NS_PER_S)
        self._stamps_ns = [0] * limits.lost_at
        self._oldest = 0
        self._state = BudgetState.OK

    def note_failure(self, now_ns: int) -> BudgetState:
        """Count one failure and return the state."""
        size = len(self._stamps_ns)
        if self.count == size:
            self._oldest = (self._oldest + 1) % size
            self.count -= 1
        self._stamps_ns[(self._oldest + self.count) % size] = now_ns
        self.count += 1
        return self.state(now_ns)

    def state(self, now_ns: int) -> BudgetState:
        """Forget what has left the window and return the state."""
        if not self.count:
            return self._state
        oldest_ns = now_ns - self._window_ns
        while self.count and self._stamps_ns[self._oldest] <= oldest_ns:
            self._oldest = (self._oldest + 1) % len(self._stamps_ns)
            self.count -= 1
        self._state = self._judge()
        return self._state

    def reset(self) -> None:
        """Forget all failures, as after a device was exchanged."""
        self.count = 0
        self._state = BudgetState.OK

    def _judge(self) -> BudgetState:
        if self.count >= self.limits.lost_at:
            return BudgetState.LOST
        if self.count <= self.limits.recover_at:
            return BudgetState.OK
        if self.count >= self.limits.degraded_at:
            return max(self._state, BudgetState.DEGRADED)
        return self._state


class BusBudget:
    """Keep a budget for each member of a bus and one for the bus itself.

    The bus counts the cycles in which a member failed that is not lost yet, or all members: one
    dead member does not speak for the bus, scattered failures of many do.
    """

    def __init__(
        self,
        names: Sequence[str],
        *,
        member: BudgetLimits = SERVO_LIMITS,
        bus: BudgetLimits = BUS_LIMITS,
    ) -> None:
        self.names = tuple(names)
        self.members = [BudgetState.OK] * len(self.names)
        """The state of each member, in the order of the names; do not write to it."""
        self.bus = BudgetState.OK
        self._budgets = tuple(ErrorBudget(member) for _ in self.names)
        self._bus_budget = ErrorBudget(bus)
        self.quiet = True
        """No failure is left in any window: good cycles need not be noted."""

    def note_cycle(self, failed: Collection[int], now_ns: int) -> None:
        """Take note which members, by index, failed in a cycle; call it after every cycle.

        A good cycle may be left out while `quiet`.
        """
        if not failed and self.quiet:
            return
        everyone = len(failed) == len(self.names)
        if everyone or any(self.members[index] is not BudgetState.LOST for index in failed):
            self._bus_budget.note_failure(now_ns)
        for index in failed:
            self._budgets[index].note_failure(now_ns)
        self.bus = self._bus_budget.state(now_ns)
        for index, budget in enumerate(self._budgets):
            self.members[index] = budget.state(now_ns)
        self.quiet = not (self._bus_budget.count or any(one.count for one in self._budgets))

    def reset(self, index: int) -> None:
        """Forget the failures of one member, as after it was rebooted or exchanged."""
        self._budgets[index].reset()
        self.members[index] = BudgetState.OK

    def as_dict(self) -> dict[str, Any]:
        """Return the states for telemetry: of the bus, and the names of members in trouble."""
        named = list(zip(self.names, self.members, strict=True))
        return {
            "bus": self.bus.name.lower(),
            "degraded": [name for name, state in named if state is BudgetState.DEGRADED],
            "lost": [name for name, state in named if state is BudgetState.LOST],
        }
