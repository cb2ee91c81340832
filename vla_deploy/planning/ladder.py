"""Ask one rung after the other for a plan, check what each proposes, and note why it was not it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final, Protocol

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.one_line import one_line
from vla_deploy.planning.asking import Proposal, Request, Rung
from vla_deploy.planning.errors import (
    Ambiguous,
    Declined,
    NotAble,
    NotUnderstood,
    PlanInvalid,
    PlanningError,
)
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.scope import guarded

_REASON_CHARACTERS: Final = 200


class Check(Protocol):
    """Make a proposed plan one that may run, or say why it may not."""

    def __call__(self, plan: Plan, request: Request) -> Plan:
        """Return the plan with its references grounded and everything checked.

        Raises:
            PlanInvalid: it may not run; carries every fault.
            Ambiguous: only the person can tell what is meant.
            PlanningError: it speaks of what the robot does not know.
        """
        ...


class Outcome(StrEnum):
    """Say how asking a rung ended."""

    PLANNED = "planned"
    ASKED = "asked"
    DECLINED = "declined"
    REFUSED = "refused"
    INVALID = "invalid"
    LATE = "late"


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """Hold how asking one rung ended, and how long that took."""

    rung: str
    outcome: Outcome
    took_s: float
    reason: str = ""

    def document(self) -> dict[str, Any]:
        """Return it as JSON takes it."""
        told = {"rung": self.rung, "outcome": self.outcome.value, "took_s": round(self.took_s, 4)}
        return {**told, "reason": self.reason} if self.reason else told


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Hold what came of a command: a `plan` that may run, or why there is none.

    `proposal` is the plan as its rung proposed it, before it was grounded and checked.
    """

    attempts: tuple[Attempt, ...] = ()
    plan: Plan | None = None
    proposal: Proposal | None = None
    error: PlanningError | None = None

    @property
    def read_back(self) -> str:
        """Return what the rung wants to be agreed to before anything moves, "" for nothing."""
        return "" if self.proposal is None else self.proposal.read_back

    @property
    def is_final(self) -> bool:
        """Tell whether nobody else needs to be asked."""
        return self.plan is not None or isinstance(self.error, Ambiguous | NotAble)


_OUTCOMES: Final = (
    (Ambiguous, Outcome.ASKED),
    (PlanInvalid, Outcome.INVALID),
    (Declined, Outcome.DECLINED),
    (NotUnderstood, Outcome.DECLINED),
)
# What an error tells a person, the most first: that a rung has no plan tells least.
_SPECIFIC: Final = 1
_RANKS: Final = ((Ambiguous, 0), (PlanInvalid, 2), (NotUnderstood, 3), (Declined, 4))


class Ladder:
    """Hold rungs in the order in which they are asked."""

    def __init__(self, rungs: Sequence[Rung], check: Check, clock: Clock) -> None:
        self.rungs = tuple(rungs)
        self._check = check
        self._clock = clock

    def climb(self, request: Request, deadline: Deadline, before: Answer | None = None) -> Answer:
        """Return the first plan that may run; `before` is what came of the rungs asked before.

        Each rung may take an equal share of the time that is left for all that could still be
        asked. What the others said is told by the error of the answer: the one that helps most.
        """
        answer = before or Answer()
        for number, rung in enumerate(self.rungs):
            if answer.is_final:
                break
            answer = self._ask(rung, request, deadline, len(self.rungs) - number, answer)
        return answer

    def _ask(
        self, rung: Rung, request: Request, deadline: Deadline, left_to_ask: int, before: Answer
    ) -> Answer:
        began_ns = self._clock.now_ns()
        share = deadline.share(left_to_ask)
        found = self._asked(rung, request, share, deadline)
        attempt = Attempt(
            rung=rung.name,
            outcome=_outcome(found.error, share),
            took_s=(self._clock.now_ns() - began_ns) / NS_PER_S,
            reason="" if found.error is None else one_line(found.error)[:_REASON_CHARACTERS],
        )
        error = None if found.error is None else more_helpful(before.error, found.error)
        return replace(found, attempts=(*before.attempts, attempt), error=error)

    def _asked(self, rung: Rung, request: Request, share: Deadline, whole: Deadline) -> Answer:
        try:
            if share.left_s <= 0.0:
                raise Declined("no time is left")
            proposal = guarded(rung.propose(request, share), request)
            plan = self._check(proposal.plan, request)
            if whole.left_s <= 0.0:
                raise Declined("its plan came too late")
        except PlanningError as error:
            return Answer(error=error)
        return Answer(plan=plan, proposal=proposal)


def more_helpful(before: PlanningError | None, error: PlanningError) -> PlanningError:
    """Return the error that tells a person more; of equals the first, a question before all."""
    return error if before is None else min(before, error, key=_rank)


def _rank(error: PlanningError) -> int:
    return next((rank for kind, rank in _RANKS if isinstance(error, kind)), _SPECIFIC)


def _outcome(error: PlanningError | None, share: Deadline) -> Outcome:
    if error is None:
        return Outcome.PLANNED
    outcome = next((told for kind, told in _OUTCOMES if isinstance(error, kind)), Outcome.REFUSED)
    is_late = outcome is Outcome.DECLINED and share.left_s <= 0.0
    return Outcome.LATE if is_late else outcome
