"""Keep count of a command's plans that failed, and of how long another one is waited for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.planning.recovery import MOST_RECOVERIES
from vla_deploy.skills.executor import ActionRecord

# A planner that asks servers takes this long at most, and needs a moment besides.
WAIT_NS: Final = 22 * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """Hold the actions of all plans of one command so far, and until when the next is awaited."""

    records: tuple[ActionRecord, ...] = ()
    plans: int = 0
    until_ns: int = 0

    @property
    def is_awaited(self) -> bool:
        """Tell whether the executor waits for another plan."""
        return self.until_ns > 0

    @property
    def may_go_on(self) -> bool:
        """Tell whether another plan may be asked for."""
        return self.plans <= MOST_RECOVERIES

    def is_overdue(self, now_ns: int) -> bool:
        """Tell whether it would come too late by now."""
        return 0 < self.until_ns < now_ns

    def after(self, records: Sequence[ActionRecord]) -> "Recovery":
        """Return it with one plan more that has ended."""
        return replace(self, records=(*self.records, *records), plans=self.plans + 1)

    def awaiting(self, now_ns: int) -> "Recovery":
        """Wait for another plan from now on."""
        return replace(self, until_ns=now_ns + WAIT_NS)

    def going_on(self) -> "Recovery":
        """Return it with another plan under way."""
        return replace(self, until_ns=0)
