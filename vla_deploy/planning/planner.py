"""Ask the back ends for a plan, one after the other, and check what each proposes.

The order: exact patterns, language models, the command parser. What patterns make of
a sentence with words that change its scope is checked by a language model where there is one; what
the parser makes of it, where a language model saw no way. Where they move other things, the person
is asked.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.payloads.tasks import BackEndsStatus
from vla_deploy.planning.comparison import move_the_same
from vla_deploy.planning.errors import Ambiguous, Declined, NotUnderstood
from vla_deploy.planning.interfaces import (
    Aid,
    Attempt,
    AttemptOutcome,
    BackEnd,
    Check,
    PlanningResult,
    PlanRequest,
    Proposal,
)
from vla_deploy.planning.patterns.backend import Patterns
from vla_deploy.planning.prohibitions import held_to
from vla_deploy.planning.scope import guarded, moves_anything, scope_words
from vla_deploy.planning.understanding.grounding import ground_plan
from vla_deploy.plans.dialects import Json, parse_plan
from vla_deploy.plans.errors import PlanError, PlanInvalid
from vla_deploy.plans.plan import Plan
from vla_deploy.plans.validator import check_plan
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.one_line import one_line

WITHIN_S: Final = 20.0
# What language models leave of the time to the command parser, which needs a fraction of that.
PARSER_S: Final = 2.0
_REASON_CHARACTERS: Final = 200
# What an error is called in events, and its rank: a person reads the error of the least rank.
_ERRORS: Final = (
    (Ambiguous, AttemptOutcome.ASKED, 0),
    (PlanInvalid, AttemptOutcome.INVALID, 2),
    (NotUnderstood, AttemptOutcome.DECLINED, 3),
    (Declined, AttemptOutcome.DECLINED, 4),
    (PlanError, AttemptOutcome.REFUSED, 1),
)

# Outcomes of a back end that leave open what it would have planned.
_SILENT: Final = frozenset({AttemptOutcome.DECLINED, AttemptOutcome.LATE})


def checked(plan: Plan, request: PlanRequest) -> Plan:
    """Return a plan grounded in the world of a request, and valid there.

    Raises:
        PlanInvalid: it may not run; carries every fault.
        Ambiguous: only the person knows what is meant.
        PlanError: it speaks of what the robot does not know.
    """
    grounded = ground_plan(plan, request)
    check_plan(grounded, request.world, request.scene, request.here)
    return held_to(request.prohibitions, grounded, request.world, request.scene)


class Planner:
    """Hold the chain of back ends; those in `slow` are asked outside the node's steps.

    Of these the language models come first, whatever their order in `slow`. `away` maps models and
    servers that it should ask and cannot to the reason.
    """

    def __init__(
        self,
        clock: Clock,
        slow: Sequence[BackEnd] = (),
        *,
        within_s: float = WITHIN_S,
        check: Check = checked,
        away: Mapping[str, str] | None = None,
    ) -> None:
        self.within_s = within_s
        self.away = dict(away or {})
        self.check = check
        self._clock = clock
        self._patterns = Patterns()
        self._models = tuple(one for one in slow if one.is_language_model)
        self._parsers = tuple(one for one in slow if not one.is_language_model)
        self._slow = (*self._models, *self._parsers)

    @property
    def back_ends(self) -> tuple[str, ...]:
        """Return the names of all back ends, in the order in which they are asked."""
        return tuple(one.name for one in (self._patterns, *self._slow))

    @property
    def slow_back_ends(self) -> tuple[str, ...]:
        """Return the names of the back ends that take time."""
        return tuple(one.name for one in self._slow)

    @property
    def uses(self) -> frozenset[Aid]:
        """Return what any of the back ends can use."""
        return frozenset().union(*(one.uses for one in self._slow))

    def document(self) -> BackEndsStatus:
        """Return who plans and how the servers have been doing, as JSON takes it."""
        documents = (one.document() for one in self._slow)
        return {
            "rungs": list(self.back_ends),
            "servers": [one for one in documents if one is not None],
            "away": self.away,
        }

    def close(self) -> None:
        """Release the models on board; planning after that does without them."""
        for one in self._slow:
            one.close()

    def plan(self, request: PlanRequest) -> PlanningResult:
        """Return the answer of all back ends together; blocks until then."""
        deadline = Deadline.within(self._clock, self.within_s)
        answer = self.plan_at_once(request, deadline)
        return self.plan_slowly(request, deadline, answer) if self.goes_on(answer) else answer

    def plan_at_once(self, request: PlanRequest, deadline: Deadline) -> PlanningResult:
        """Return the answer of the back ends that take no time."""
        answer = self.first_plan((self._patterns,), request, deadline)
        if not self._slow:
            return _worded(answer, request)
        return replace(answer, is_unchecked=bool(self._models) and _needs_check(answer, request))

    def goes_on(self, answer: PlanningResult) -> bool:
        """Return whether the back ends that take time are to be asked after those that do not."""
        return bool(self._slow) and (answer.is_unchecked or not answer.is_final)

    def plan_slowly(
        self, request: PlanRequest, deadline: Deadline, before: PlanningResult
    ) -> PlanningResult:
        """Return the answer of the others too; blocks until the deadline at most.

        A plan of `before` stands, as the language models find it; without one the parser is asked
        where they have none either.
        """
        has_plan = before.plan is not None
        reserved_s = 0.0 if has_plan or not self._parsers else PARSER_S
        models_by = deadline.sooner(min(reserved_s, deadline.left_s / 2))
        begun = PlanningResult(attempts=before.attempts) if has_plan else before
        found = self.first_plan(self._models, request, models_by, begun)
        if not has_plan and found.is_final:
            return found
        if has_plan:
            quick = replace(before, attempts=found.attempts, is_unchecked=False)
        else:
            quick = self.first_plan(self._parsers, request, deadline, found)
        said = found.attempts[len(before.attempts) :]
        if _needs_check(quick, request) and any(one.outcome not in _SILENT for one in said):
            quick = _checked_by(found.plan, quick, request)
        return _worded(quick, request)

    def check_given(
        self, document: Json | list[object] | str, request: PlanRequest
    ) -> PlanningResult:
        """Return the answer to a plan that was made elsewhere, in any dialect."""
        deadline = Deadline.within(self._clock, self.within_s)
        return self.first_plan((_GivenPlan(document),), request, deadline)

    def first_plan(
        self,
        back_ends: Sequence[BackEnd],
        request: PlanRequest,
        deadline: Deadline,
        before: PlanningResult | None = None,
    ) -> PlanningResult:
        """Return the first plan that may run; `before` is what came of those asked before.

        Each back end may take an equal share of the time that is left for all that could still be
        asked. Without a plan, the answer has the error of those that helps a person most.
        """
        answer = before or PlanningResult()
        for number, back_end in enumerate(back_ends):
            if answer.is_final:
                break
            share = deadline.share(len(back_ends) - number)
            began_ns = self._clock.now_ns()
            found = self._ask(back_end, request, share, deadline)
            attempt = Attempt(
                back_end=back_end.name,
                outcome=_outcome(found.error, share),
                took_s=(self._clock.now_ns() - began_ns) / NS_PER_S,
                reason="" if found.error is None else one_line(found.error)[:_REASON_CHARACTERS],
            )
            errors = [one for one in (answer.error, found.error) if one is not None]
            error = min(errors, key=_rank) if found.error is not None else None
            answer = replace(found, attempts=(*answer.attempts, attempt), error=error)
        return answer

    def _ask(
        self, back_end: BackEnd, request: PlanRequest, share: Deadline, whole: Deadline
    ) -> PlanningResult:
        try:
            if share.left_s <= 0.0:
                raise Declined("no time is left")
            proposal = guarded(back_end.propose(request, share), request)
            plan = self.check(proposal.plan, request)
            if whole.left_s <= 0.0:
                raise Declined("its plan came too late")
        except PlanError as error:
            return PlanningResult(error=error)
        return PlanningResult(plan=plan, proposal=proposal)


class _GivenPlan(BackEnd):
    """Propose a plan that came with the command."""

    name = "given"

    def __init__(self, given: Json | list[object] | str) -> None:
        self._given = given

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        del request, deadline  # the plan is there already
        return Proposal(plan=parse_plan(self._given), back_end=self.name, confidence=1.0)


def _rank(error: PlanError) -> int:
    return next(rank for kind, _, rank in _ERRORS if isinstance(error, kind))


def _outcome(error: PlanError | None, share: Deadline) -> AttemptOutcome:
    if error is None:
        return AttemptOutcome.PLANNED
    outcome = next(outcome for kind, outcome, _ in _ERRORS if isinstance(error, kind))
    is_late = outcome is AttemptOutcome.DECLINED and share.left_s <= 0.0
    return AttemptOutcome.LATE if is_late else outcome


def _needs_check(answer: PlanningResult, request: PlanRequest) -> bool:
    """Return whether a plan would move something unasked that words of its command may change."""
    plan, proposal = answer.plan, answer.proposal
    if plan is None or proposal is None or proposal.knows_grammar or proposal.is_read_back:
        return False
    return moves_anything(plan) and bool(scope_words(request.text))


def _checked_by(
    model_plan: Plan | None, quick: PlanningResult, request: PlanRequest
) -> PlanningResult:
    """Return a quick plan, read back unless the plan of a language model moves the same.

    `model_plan` is None where the model was asked and has none.
    """
    plan, proposal = quick.plan, quick.proposal
    assert plan is not None, "only plans are checked"
    assert proposal is not None, "a plan was proposed"
    if model_plan is not None and move_the_same(plan, model_plan, request):
        return quick
    return replace(quick, proposal=replace(proposal, left_out=scope_words(request.text)))


def _worded(answer: PlanningResult, request: PlanRequest) -> PlanningResult:
    """Replace the error by "not understood" where no back end has said more."""
    if isinstance(answer.error, Declined):
        return replace(answer, error=NotUnderstood(request.text, request.world))
    return answer
