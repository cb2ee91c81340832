"""Know which of the executor's parts servers beyond the robot may move now, and in whose name.

The executor holds the claim, the gateway moves the part: only while the goal is under way, only
while the claim stands, and the base only while the executor keeps giving leave to drive.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import ClaimBook
from vla_deploy.ipc.ros_goals import PERMIT_S, GoalRequest

_LOOK_NS: Final = NS_PER_S // 10


@dataclass(slots=True, kw_only=True)
class Loan:
    """Hold what one goal may move; `permit_ns` is when the executor last gave leave to drive."""

    holder: str
    parts: frozenset[str]
    most_m_s: float
    permit_ns: int


class Lending:
    """Hold what is lent to the goals under way."""

    def __init__(self, link: RobotLink) -> None:
        self._clock = link.clock
        self._book = ClaimBook(link.space, link.clock)
        self._loans: dict[str, Loan] = {}
        self._looked_ns = 0

    def lend(self, request: GoalRequest) -> str:
        """Lend a goal what its request names; return why not, "" where it is lent."""
        why = self._not_held(request.holder, frozenset(request.parts))
        if not why:
            self._loans[request.request_id] = Loan(
                holder=request.holder,
                parts=frozenset(request.parts),
                most_m_s=request.most_m_s or math.inf,
                permit_ns=self._clock.now_ns(),
            )
        return why

    def permit(self, request_id: str, *, drives: bool) -> None:
        """Lend a goal the base for a moment, or hold it."""
        if request_id in self._loans:
            self._loans[request_id].permit_ns = self._clock.now_ns() if drives else -NS_PER_S

    def end(self, request_id: str) -> None:
        """Take back what a goal was lent; taking back nothing is allowed."""
        self._loans.pop(request_id, None)

    def step(self, now_ns: int) -> dict[str, str]:
        """Return the goals whose holder has lost its claim, and why; they are lent nothing more."""
        if not self._loans or now_ns - self._looked_ns < _LOOK_NS:
            return {}
        self._looked_ns = now_ns
        over = {one: self._not_held(loan.holder, loan.parts) for one, loan in self._loans.items()}
        over = {one: why for one, why in over.items() if why}
        for request_id in over:
            self.end(request_id)
        return over

    def why_not(self, parts: Sequence[str], *, driving: bool) -> str:
        """Return why a server may not move some parts now, "" where it may."""
        loan = self._loan_of(parts)
        if loan is None:
            return f"no goal of the executor is under way that moves {', '.join(parts)}"
        age_ns = self._clock.now_ns() - loan.permit_ns
        if driving and age_ns > round(PERMIT_S * NS_PER_S):
            return "the executor gives no leave to drive now"
        return ""

    def most_m_s(self, parts: Sequence[str]) -> float:
        """Return the greatest speed of a loan, in m/s."""
        loan = self._loan_of(parts)
        return math.inf if loan is None else loan.most_m_s

    def _loan_of(self, parts: Sequence[str]) -> Loan | None:
        return next((loan for loan in self._loans.values() if loan.parts.issuperset(parts)), None)

    def _not_held(self, holder: str, parts: frozenset[str]) -> str:
        for claim in self._book.look().granted:
            if claim.holder == holder and parts <= claim.wants.keys():
                return ""
        return f"{holder} does not hold {', '.join(sorted(parts))} (any more)"


class Borrowed:
    """Hold parts in the executor's name, while it lends them to the server of one of its goals."""

    def __init__(self, lending: Lending, parts: Sequence[str], *, driving: bool = False) -> None:
        self.is_held = False
        self._lending = lending
        self._parts = tuple(parts)
        self._driving = driving

    def why_not_taken(self) -> str:
        """Take them, or return why they are not lent now."""
        why = self._lending.why_not(self._parts, driving=self._driving)
        self.is_held = not why
        return why

    def why_over(self) -> str:
        """Return why they are not lent any more."""
        return self._lending.why_not(self._parts, driving=self._driving) if self.is_held else ""

    def most_m_s(self) -> float:
        """Return the speed that the executor allows the base, in m/s."""
        return self._lending.most_m_s(self._parts)

    def release(self) -> None:
        """Move them no longer; the executor goes on to hold them."""
        self.is_held = False
