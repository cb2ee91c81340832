"""Declare how each process takes part in the twin's time."""

from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from drivers.twin_page import TimeRole

_SLACK_NS: Final = NS_PER_S // 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Membership:
    """Say how a process holds time, and how much of it passes while its program loads.

    What moves the robot holds time strictly: what it does is a matter of simulated time alone. What
    only watches lets it go on for a moment, beside the others.
    """

    role: TimeRole
    loading_s: float


def _member(name: str, order: int, loading_s: float, slack_ns: int | None = 0) -> Membership:
    return Membership(role=TimeRole(name=name, order=order, slack_ns=slack_ns), loading_s=loading_s)


MEMBERSHIPS: Final = {
    one.role.name: one
    for one in (
        _member("control", 0, 1.0),
        _member("stop_door", 1, 1.0, None),
        _member("perception", 2, 2.0),
        _member("speech", 3, 2.0),
        _member("planner", 4, 2.0),
        _member("executor", 5, 2.0),
        _member("recorder", 6, 2.0, _SLACK_NS),
        _member("dashboard", 7, 2.0, None),
        _member("ros", 8, 2.0, _SLACK_NS),
    )
}
WATCHERS: Final = frozenset(name for name, one in MEMBERSHIPS.items() if one.role.slack_ns is None)
"""Live by the wall clock while they run; their end takes `STOPPING_NS` at most."""
STOPPING_NS: Final = NS_PER_S
SUPERVISOR: Final = TimeRole(name="supervisor", order=100, patience_s=60.0)
