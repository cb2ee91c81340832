"""Keep count of a command's plans that failed, and of how long another one is waited for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from vla_deploy.skills.records import ActionRecord


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """Hold the actions of all plans of one command so far, and until when the next is awaited."""

    records: tuple[ActionRecord, ...] = ()
    plans: int = 0
    until_ns: int = 0

    @property
    def is_awaited(self) -> bool:
        """Return whether the executor waits for another plan."""
        return self.until_ns > 0

    def may_go_on(self, further_plans: int) -> bool:
        """Return whether another plan may be asked for, of so many beside the first."""
        return self.plans <= further_plans

    def is_overdue(self, now_ns: int) -> bool:
        """Return whether it would come too late by now."""
        return 0 < self.until_ns < now_ns

    def after(self, records: Sequence[ActionRecord]) -> "Recovery":
        """Return it with one plan more that has ended."""
        return replace(self, records=(*self.records, *records), plans=self.plans + 1)

    def awaiting(self, until_ns: int) -> "Recovery":
        """Wait for another plan until then."""
        return replace(self, until_ns=until_ns)

    def going_on(self) -> "Recovery":
        """Return it with another plan under way."""
        return replace(self, until_ns=0)
