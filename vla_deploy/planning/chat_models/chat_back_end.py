"""Do what planning with any chat model has in common: read its answer, and propose the plan."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.chat_models.plan_answer import PlanAnswer, answer_for
from vla_deploy.planning.dialogue.phrasing import Says, steps_in_words
from vla_deploy.planning.errors import Ambiguous, CannotBeDone
from vla_deploy.planning.interfaces import Aid, BackEnd, Check, Proposal, Request
from vla_deploy.planning.plan import Plan

SURE: Final = 0.75
"""A plan of which a model is less sure is read back before anything moves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCandidate:
    """Hold a plan that may run, and how sure its model is of it, 0 to 1.

    `plan` is as it was proposed, `checked` as it would run.
    """

    plan: Plan
    checked: Plan
    confidence: float


class ChatBackEnd(BackEnd):
    """Hold how the answers of one chat model become proposals; `shape` is that of an answer."""

    is_language_model = True
    uses = frozenset({Aid.MEMORY})

    def __init__(self, name: str, robot: str, places: Sequence[str], check: Check) -> None:
        self.name = name
        self.robot = robot
        self.shape = answer_for(places)
        self._check = check

    def candidate(self, answer: PlanAnswer, request: Request) -> PlanCandidate:
        """Return the plan that a model has answered, if it may run.

        Raises:
            Ambiguous: the model asks something, or what it names is not clear.
            CannotBeDone: the model sees no way, and says why.
            PlanningError: what it plans may not run.
        """
        if answer.question:
            raise Ambiguous(answer.question)
        if not answer.feasible or not answer.steps:
            reason = answer.reasoning or "it gives no reason"
            raise CannotBeDone(f"{self.name} sees no way to do it: {reason}")
        plan = answer.plan(request.text)
        checked = self._check(plan, request)
        return PlanCandidate(plan=plan, checked=checked, confidence=answer.confidence)

    def proposal(
        self, candidate: PlanCandidate, confidence: float, *, may_be_kept: bool = True
    ) -> Proposal:
        """Return a plan with what is read back of it where the model is not sure."""
        steps = steps_in_words(candidate.checked)
        return Proposal(
            plan=candidate.plan,
            back_end=self.name,
            confidence=round(confidence, 3),
            read_back="" if confidence >= SURE else Says.CONFIRM.format(steps=steps),
            may_be_kept=may_be_kept,
            knows_grammar=True,
        )
