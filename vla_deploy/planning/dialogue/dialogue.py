"""Hold the talk, and bring what was planned to its end: to the executor, to a question, or refused.

At most one question waits at a time. Beside it a plan may be held until the person says go; what
else is said does not drop it.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Final

from drivers.clock import Clock
from vla_deploy.ipc.payloads.tasks import PlannerCounts
from vla_deploy.planning.dialogue.active_plans import ActivePlans
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.confirmation import agreement_to, confirmation_of, question_about
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.phrasing import Says, spoken_refusal
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.interfaces import Attempt, PlanningResult, PlanRequest
from vla_deploy.planning.recovery.setback import numbered
from vla_deploy.planning.understanding import (
    AnswerVerdict,
    Candidate,
    Conversation,
    ConversationTurn,
    Question,
    TurnOutcome,
    judge_answer,
)
from vla_deploy.planning.understanding.conversation import ANSWER_LIMIT_S, mentions_of
from vla_deploy.plans.agent_rules import NO_ORDERS
from vla_deploy.plans.errors import PlanError, PlanInvalid
from vla_deploy.plans.plan import Plan

MOST_ASKED: Final = 3
HELD_S: Final = 3600.0
"""How long a plan waits for the word that begins it."""


@dataclass(slots=True)
class PlannerMetrics:
    """Count what came of commands, and of each back end; `failed` are faults of the planner."""

    heard: int = 0
    planned: int = 0
    refused: int = 0
    asked: int = 0
    failed: int = 0
    by_rung: defaultdict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))

    def note(self, attempts: Iterable[Attempt]) -> None:
        """Count what the back ends did for one command."""
        for one in attempts:
            self.by_rung[one.back_end][one.outcome.value] += 1

    def document(self) -> PlannerCounts:
        """Return the counts as JSON takes them."""
        return {
            "heard": self.heard,
            "planned": self.planned,
            "refused": self.refused,
            "asked": self.asked,
            "failed": self.failed,
            "by_rung": self.by_rung,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class PendingQuestion:
    """Hold the command that waits for an answer; `plan` is what a yes lets run."""

    command: UserCommand
    answer: PlanningResult
    question: Question
    times_asked: int = 1

    @property
    def plan(self) -> Plan | None:
        """Return what a yes lets run."""
        return self.answer.plan

    @property
    def is_open(self) -> bool:
        """Return whether any words may answer it, rather than yes, no, or one of a few."""
        return self.plan is None and not self.question.candidates


class Dialogue:
    """Conclude commands, publish it, and remember it for what is said next.

    `accepted` is called before a plan is dispatched for a command of its own.
    """

    def __init__(
        self,
        accepted: Callable[[PlanRequest, PlanningResult], None],
        situation: Situation,
        events: PlannerEvents,
        active: ActivePlans,
        clock: Clock,
    ) -> None:
        self.conversation = Conversation()
        self.pending: PendingQuestion | None = None
        self.held: PendingQuestion | None = None
        self.metrics = PlannerMetrics()
        self._accepted = accepted
        self._situation = situation
        self._events = events
        self._active = active
        self._clock = clock

    # --- what was planned -----------------------------------------------------------------------

    def conclude(self, done: PlannedCommand) -> None:
        """Dispatch a command's plan where it may run at once; else ask, or say what forbids it."""
        command, answer = done.command, done.answer
        if command.is_corrected and not command.recovers and answer.proposal is not None:
            answer = replace(answer, proposal=replace(answer.proposal, is_unsure=True))
            done = replace(done, answer=answer)
        self.metrics.note(answer.attempts)
        left = self.settle()  # what was chosen concerned this command alone
        if left is not None and left.command.command_id != command.command_id:
            self.drop(left, Says.REPLACED)
        try:
            if answer.is_final:
                self._situation.check_ready()
            if answer.plan is None:
                raise answer.error or PlanInvalid(["no back end was asked for a plan"])
            if command.is_of_agent and answer.proposal and answer.proposal.order:
                raise NO_ORDERS
            if not command.recovers:
                self._situation.check_battery(answer.plan)
            self._events.check_length(answer.plan)
            if done.awaits_word and not command.recovers:  # the word has been said
                self.hold(done)
                return
            agreed = self._active.agreed(command)
            question = confirmation_of(answer.plan, done.request, answer.proposal, agreed)
            if question:
                raise Ambiguous(question)
            self.dispatch(done, answer.plan)
        except Ambiguous as unclear:
            if command.recovers:  # the robot stands in the middle of it: it does not wait
                self.refuse(command, unclear, answer)
            else:
                self.pending = self._asked(done, unclear)
        except PlanError as error:
            self.refuse(command, error, answer)

    def dispatch(self, done: PlannedCommand, plan: Plan) -> None:
        """Give a checked plan to the executor, and remember what was understood."""
        command, request, answer = done.command, done.request, done.answer
        if command.recovers:
            plan = numbered(plan, len(request.failed))
        else:
            self._accepted(request, answer)
        self._events.dispatched(command, plan, answer)
        agreed = agreement_to(plan, request)
        self._active.add(command, plan, answer, self._clock.now_ns(), agreed)
        self.metrics.planned += 1
        self._remember_plan(done, plan, TurnOutcome.UNDER_WAY)

    def hold(self, done: PlannedCommand) -> None:
        """Read a plan back, and hold it until the person says go; one that was held is dropped."""
        self.drop(self.take_held(), Says.REPLACED)
        plan = done.answer.plan
        assert plan is not None, "only plans are held"
        asks = Says.HELD.format(question=question_about(plan, done.request, done.answer.proposal))
        self.held = self._asked(done, Ambiguous(asks), limit_s=HELD_S, choices=("go",))
        # "No, the blue one" means this plan, not what was done before it.
        self._remember_plan(done, plan, TurnOutcome.ASKED)

    def refuse(
        self,
        command: UserCommand,
        reason: PlanError | str,
        answer: PlanningResult | None = None,
        outcome: TurnOutcome = TurnOutcome.REFUSED,
    ) -> None:
        """Say why a command is not done."""
        if command.recovers:
            self._events.gave_up(command.command_id, str(reason))
            return
        self.metrics.refused += 1
        self._events.refused(command, str(reason), answer)
        if command.is_doubted:
            if command.may_ask_again:
                self._events.say(command, Says.HEARD_BADLY)
        elif outcome is not TurnOutcome.CANCELLED or isinstance(reason, Says):
            self._events.say(command, spoken_refusal(reason))
        self.remember(command, outcome, answer=str(reason))

    def drop(self, pending: PendingQuestion | None, why: Says) -> None:
        """Say that what waits for an answer, if anything does, is left."""
        if pending is not None:
            self.refuse(pending.command, why, pending.answer, TurnOutcome.CANCELLED)

    # --- what waits for an answer ---------------------------------------------------------------

    def _asked(
        self,
        done: PlannedCommand,
        unclear: Ambiguous,
        limit_s: float = ANSWER_LIMIT_S,
        choices: tuple[str, ...] = (),
    ) -> PendingQuestion:
        """Ask, and return what waits for the answer."""
        question = Question(
            text=unclear.question,
            asked_ns=self._clock.now_ns(),
            command_text=done.command.text,
            expression=unclear.expression,
            candidates=unclear.candidates,
            choices=done.request.conversation.choices,
            limit_s=limit_s,
        )
        self.metrics.asked += 1
        self._events.asked(done.command, question, done.answer.plan, choices)
        return PendingQuestion(command=done.command, answer=done.answer, question=question)

    def ask_again(self, pending: PendingQuestion) -> None:
        """Ask once more in other words, or leave it when that was enough."""
        if pending.times_asked >= MOST_ASKED:
            self.drop(self.settle(), Says.STILL_UNCLEAR)
            return
        asked = replace(pending.question, asked_ns=self._clock.now_ns())
        self.pending = replace(pending, question=asked, times_asked=pending.times_asked + 1)
        told = replace(asked, text=Says.NOT_CLEAR.format(question=asked.text))
        self._events.asked(pending.command, told, pending.plan)

    def judge(self, text: str) -> tuple[AnswerVerdict, Candidate | None]:
        """Return what an utterance is to the question that waits, and which candidate it picks."""
        if self.pending is None or self._is_overdue(self.pending):
            return AnswerVerdict.ANEW, None
        return judge_answer(self.pending.question, text)

    def declines(self, text: object) -> bool:
        """Return whether words such as "never mind" mean the question, and not all that goes on."""
        return isinstance(text, str) and self.judge(text)[0] is AnswerVerdict.NO

    @property
    def waits_for_person(self) -> str:
        """Return the question that is open, or that of a held plan; "" where nothing waits."""
        waiting = self.pending or self.held
        return "" if waiting is None else waiting.question.text

    def settle(self) -> PendingQuestion | None:
        """Wait no more, and return what waited; nothing that was chosen counts any more."""
        pending, self.pending = self.pending, None
        self.conversation = replace(self.conversation, choices={})
        return pending

    def choose(self, question: Question, chosen: Candidate | None) -> None:
        """Wait no more; what was chosen counts while the command that waited is planned."""
        picked = {} if chosen is None else {question.expression: chosen.name}
        self.pending = None
        self.conversation = replace(self.conversation, choices={**question.choices, **picked})

    def take_held(self) -> PendingQuestion | None:
        """Return what was held, and hold nothing any more."""
        held, self.held = self.held, None
        return held

    def drop_overdue(self) -> None:
        """Leave the question that nobody answered in time, and the plan whose word has not come."""
        if self.pending is not None and self._is_overdue(self.pending):
            self.drop(self.settle(), Says.NO_ANSWER)
        if self.held is not None and self._is_overdue(self.held):
            self.drop(self.take_held(), Says.NO_ANSWER)

    def _is_overdue(self, pending: PendingQuestion) -> bool:
        return not pending.question.is_open(self._clock.now_ns())

    # --- what was said and done -----------------------------------------------------------------

    def remember(self, command: UserCommand, outcome: TurnOutcome, **known: Any) -> None:
        """Add a turn to the conversation: a command, what came of it, and what else is known."""
        text, command_id, told_ns = command.text, command.command_id, command.told_ns
        turn = ConversationTurn(
            said=text, command_id=command_id, told_ns=told_ns, outcome=outcome, **known
        )
        self.conversation = self.conversation.after(turn)

    def _remember_plan(self, done: PlannedCommand, plan: Plan, outcome: TurnOutcome) -> None:
        mentioned, here = mentions_of(plan, done.request.scene), done.request.here
        told = {"understood": plan.summary, "mentioned": mentioned, "plan": plan, "here": here}
        self.remember(done.command, outcome, **told)

    def ended(self, command_id: str, success: bool, error: str) -> None:
        """Note how a command ended that was carried out."""
        outcome = TurnOutcome.SUCCEEDED if success else TurnOutcome.FAILED
        self.conversation = self.conversation.ended(command_id, outcome, error)
