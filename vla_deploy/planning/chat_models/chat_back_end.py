"""Do what planning with any chat model has in common: read its answer, and propose the plan."""

from collections.abc import Sequence
from typing import Final

from vla_deploy.planning.chat_models.plan_answer import PlanAnswer, answer_for
from vla_deploy.planning.errors import Ambiguous, CannotBeDone
from vla_deploy.planning.interfaces import Aid, BackEnd, Proposal, Request
from vla_deploy.planning.plan import Plan

SURE: Final = 0.75
"""A plan of which a model is less sure is read back before anything moves."""


class ChatBackEnd(BackEnd):
    """Hold how the answers of one chat model become proposals; `shape` is that of an answer."""

    is_language_model = True
    uses = frozenset({Aid.MEMORY})

    def __init__(self, name: str, robot: str, places: Sequence[str]) -> None:
        self.name = name
        self.robot = robot
        self.shape = answer_for(places)

    def planned(self, answer: PlanAnswer, request: Request) -> Plan:
        """Return the plan that a model has answered, as yet unchecked.

        Raises:
            Ambiguous: the model asks something.
            CannotBeDone: the model sees no way, and says why.
        """
        if answer.question:
            raise Ambiguous(answer.question)
        if not answer.feasible or not answer.steps:
            reason = answer.reasoning or "it gives no reason"
            raise CannotBeDone(f"{self.name} sees no way to do it: {reason}")
        return answer.plan(request.text)

    def proposal(self, plan: Plan, confidence: float, *, may_be_kept: bool = True) -> Proposal:
        """Return a plan, which is read back where the model is not sure."""
        return Proposal(
            plan=plan,
            back_end=self.name,
            confidence=round(confidence, 3),
            is_unsure=confidence < SURE,
            may_be_kept=may_be_kept,
            knows_grammar=True,
        )
