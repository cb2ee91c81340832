"""Bring what was planned for a command to its end: handed to the executor, asked, or refused."""

from collections.abc import Callable

from vla_deploy.planning.dialogue.active_plans import ActivePlans
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.confirmation import (
    agreement_to,
    confirmation_of,
    question_about,
)
from vla_deploy.planning.dialogue.dialogue_state import DialogueState, PendingQuestion
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.phrasing import Says, spoken_refusal
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import Ambiguous, PlanInvalid, PlanningError
from vla_deploy.planning.interfaces import PlanningResult, Request
from vla_deploy.planning.metrics import PlannerMetrics
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.recovery.setback import numbered
from vla_deploy.planning.understanding import Outcome, Turn
from vla_deploy.planning.understanding.conversation import mentions_of


class CommandDispatcher:
    """Conclude commands, publish it, and remember it for what is said next.

    `accepted` is called before a plan is dispatched for a command of its own.
    """

    def __init__(
        self,
        accepted: Callable[[Request, PlanningResult], None],
        situation: Situation,
        events: PlannerEvents,
        dialogue: DialogueState,
        active: ActivePlans,
    ) -> None:
        self.metrics = PlannerMetrics()
        self._accepted = accepted
        self._situation = situation
        self._events = events
        self._dialogue = dialogue
        self._active = active

    def conclude(self, done: PlannedCommand) -> None:
        """Dispatch a command's plan where it may run at once; else ask, or say what forbids it."""
        command, answer = done.command, done.answer
        self.metrics.note(answer.attempts)
        self._dialogue.settle()  # what was chosen concerned this command alone
        try:
            if answer.is_final:
                self._situation.check_ready()
            if answer.plan is None:
                raise answer.error or PlanInvalid(["no back end was asked for a plan"])
            self._events.check_length(answer.plan)
            if done.awaits_word and not command.recovers:  # the word has been said
                self.hold(done, answer.plan)
                return
            agreed = self._active.agreed(command)
            question = confirmation_of(answer.plan, done.request, answer.proposal, agreed)
            if question:
                raise Ambiguous(question)
            self.dispatch(done, answer.plan)
        except Ambiguous as unclear:
            if command.recovers:  # the robot stands in the middle of it: it does not wait
                self.refuse(command, unclear, answer)
                return
            self.metrics.asked += 1
            pending = self._dialogue.ask(done, unclear)
            self._events.asked(command, pending.question, pending.plan)
        except PlanningError as error:
            self.refuse(command, error, answer)

    def hold(self, done: PlannedCommand, plan: Plan) -> None:
        """Read a plan back, and hold it until the person says go; one that was held is dropped."""
        self.drop(self._dialogue.take_held(), Says.REPLACED)
        question = question_about(plan, done.request, done.answer.proposal)
        held = self._dialogue.hold(done, Says.HELD.format(question=question))
        self.metrics.asked += 1
        self._events.asked(done.command, held.question, plan, choices=("go",))
        # "No, the blue one" means this plan, not what was done before it.
        self._remember(done, plan, Outcome.ASKED)

    def drop(self, pending: PendingQuestion | None, why: Says) -> None:
        """Say that what waits for an answer, if anything does, is left."""
        if pending is not None:
            self.refuse(pending.command, why, pending.answer, Outcome.CANCELLED)

    def dispatch(self, done: PlannedCommand, plan: Plan) -> None:
        """Give a checked plan to the executor, and remember what was understood."""
        command, request, answer = done.command, done.request, done.answer
        if command.recovers:
            plan = numbered(plan, len(request.failed))
        if not command.recovers:
            self._accepted(request, answer)
        self._events.dispatched(command, plan, answer)
        self._active.add(command, plan, answer, agreement_to(plan, request))
        self.metrics.planned += 1
        self._remember(done, plan, Outcome.UNDER_WAY)

    def _remember(self, done: PlannedCommand, plan: Plan, outcome: Outcome) -> None:
        command, request = done.command, done.request
        self._dialogue.remember(
            Turn(
                said=command.text,
                command_id=command.command_id,
                told_ns=command.told_ns,
                understood=plan.summary,
                mentioned=mentions_of(plan, request.scene),
                plan=plan,
                outcome=outcome,
                here=request.here,
            )
        )

    def refuse(
        self,
        command: UserCommand,
        reason: PlanningError | str,
        answer: PlanningResult | None = None,
        outcome: Outcome = Outcome.REFUSED,
    ) -> None:
        """Say why a command is not done."""
        if command.recovers:
            self._events.gave_up(command.command_id, str(reason))
            return
        self.metrics.refused += 1
        self._events.refused(command, str(reason), answer)
        if command.is_doubted and command.may_ask_again:
            self._events.say(command, Says.HEARD_BADLY)
        elif not command.is_doubted and (
            outcome is not Outcome.CANCELLED or isinstance(reason, Says)
        ):
            self._events.say(command, spoken_refusal(reason))
        self._dialogue.remember(
            Turn(
                said=command.text,
                command_id=command.command_id,
                told_ns=command.told_ns,
                outcome=outcome,
                answer=str(reason),
            )
        )
