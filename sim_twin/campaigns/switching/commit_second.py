"""Count the late ticks in the second around a commit, and those the computer itself explains."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from sim_twin.campaigns.switching.host_stalls import STEP_S, HostStall

HALF_S: Final = 0.5
LATE_RATIO: Final = 0.2
"""A tick is late when so much more than its period has passed since the one before."""
_COMMITTED: Final = ("commit", "watch")


@dataclass(frozen=True, slots=True, kw_only=True)
class CommitLook:
    """Hold what control had counted, and the switch's phase, at a moment of monotonic time."""

    now_ns: int
    late: int
    phase: str


def commit_ns(looks: Sequence[CommitLook]) -> int | None:
    """Return when the commit was seen first; None where there was none."""
    return next((look.now_ns for look in looks if look.phase in _COMMITTED), None)


def late_around(looks: Sequence[CommitLook], at_ns: int) -> tuple[int, int, int]:
    """Return how many ticks were late within the looks that enclose the second, and their times."""
    half_ns = round(HALF_S * NS_PER_S)
    first = max((x for x in looks if x.now_ns <= at_ns - half_ns), key=_when, default=looks[0])
    last = min((x for x in looks if x.now_ns >= at_ns + half_ns), key=_when, default=looks[-1])
    return last.late - first.late, first.now_ns, last.now_ns


def explained(stalls: Sequence[HostStall], begin_ns: int, end_ns: int, period_s: float) -> int:
    """Return how many ticks may be late for stalls of a core: one, and one more for each period."""
    return sum(
        1 + int(one.seconds / period_s)
        for one in stalls
        if begin_ns <= one.due_ns <= end_ns and one.seconds + STEP_S >= LATE_RATIO * period_s
    )


def _when(look: CommitLook) -> int:
    return look.now_ns
