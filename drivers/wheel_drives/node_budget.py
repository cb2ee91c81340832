"""Judge CAN nodes by how many cycles went without their answer."""

from collections.abc import Sequence
from typing import Final

from drivers.error_budget import BudgetLimits, BudgetState, BusBudget

NODE_LIMITS: Final = BudgetLimits(window_s=1.0, degraded_at=10, lost_at=125, recover_at=2)
"""At 250 Hz, 4 % of a second's answers missing degrade a node, half of them lose it."""


class NodeBudget:
    """Count the cycles in which a node's answer was missing, and judge node and bus by them."""

    def __init__(self, names: Sequence[str]) -> None:
        self._budget = BusBudget(names, member=NODE_LIMITS)

    @property
    def lost(self) -> tuple[bool, ...]:
        """Return of each node whether it answers too seldom to be driven."""
        return tuple(state is BudgetState.LOST for state in self._budget.members)

    @property
    def counters(self) -> dict[str, int]:
        """Return how many nodes are in trouble, and 1 where the bus itself is."""
        members = self._budget.members
        return {
            "degraded_nodes": members.count(BudgetState.DEGRADED),
            "lost_nodes": members.count(BudgetState.LOST),
            "bus_degraded": int(self._budget.bus is not BudgetState.OK),
        }

    def note_cycle(self, missing: Sequence[int], now_ns: int) -> None:
        """Note which nodes, by row, did not answer in the last cycle."""
        self._budget.note_cycle(missing, now_ns)

    def forget(self) -> None:
        """Start over, as with a new connection."""
        for row in range(len(self._budget.names)):
            self._budget.reset(row)
