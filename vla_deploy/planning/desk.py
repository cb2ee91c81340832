"""Take commands in their order, ask back, wait for answers, and hand plans on."""

import logging
from collections import deque
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from threading import Event
from typing import Any, Final

from drivers.clock import Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.accounts import Accounts
from vla_deploy.planning.asking import Request
from vla_deploy.planning.confirmation import confirmation_of
from vla_deploy.planning.errors import Ambiguous, PlanInvalid, PlanningError
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.ladder import Answer
from vla_deploy.planning.phrasing import Says
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.situation import Situation
from vla_deploy.planning.telling import Telling
from vla_deploy.planning.understanding import (
    Conversation,
    Outcome,
    Question,
    Reply,
    Turn,
    Verdict,
    reply,
)
from vla_deploy.planning.understanding.mentioned import mentions_of

MOST_WAITING: Final = 8
_MOST_ASKED: Final = 3
CANCELLED: Final = "cancelled on request"
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Work:
    """Hold the command that is planned beside the steps."""

    command: Command
    request: Request
    recall: Event
    future: "Future[Answer]"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Waiting:
    """Hold the command that waits for an answer; `plan` is what a yes lets run."""

    command: Command
    answer: Answer
    plan: Plan | None
    times_asked: int = 1


class Desk:
    """Plan one command at a time; what takes time is done in `aside`, and a stop overtakes it."""

    def __init__(
        self,
        planner: Planner,
        situation: Situation,
        telling: Telling,
        aside: Executor,
        clock: Clock,
    ) -> None:
        self.planner = planner
        self.accounts = Accounts()
        self._situation = situation
        self._telling = telling
        self._aside = aside
        self._clock = clock
        self._queue: deque[Command] = deque()
        self._work: _Work | None = None
        self._waiting: _Waiting | None = None
        self._talk = Conversation()

    # --- what comes in --------------------------------------------------------------------------

    def take(self, command: Command) -> None:
        """Take an utterance: the answer to what was asked, or a command of its own."""
        if self._waiting is not None and self._is_answer(command, self._waiting):
            return
        if command.is_answer:
            self._refuse(command, Says.NOTHING_ASKED)
        elif len(self._queue) >= MOST_WAITING:
            self._refuse(command, Says.MANY_WAIT)
        else:
            self._queue.append(command)
            if self._work is not None:
                self._telling.queued(command, len(self._queue))

    def is_declined_by(self, text: object) -> bool:
        """Tell whether words such as "never mind" mean what was asked, and not all that goes on."""
        if self._waiting is None or not isinstance(text, str):
            return False
        said = reply(self._talk, text, self._clock.now_ns())
        return said.verdict is Verdict.NO

    def stop_all(self, command_id: str) -> None:
        """Let go of every command, and let the executor end what it does."""
        self._telling.cancelled_all(command_id)
        dropped = [*self._queue]
        self._queue.clear()
        if self._work is not None:
            self._work.recall.set()
            dropped.insert(0, self._work.command)
            self._work = None
        if self._waiting is not None:
            dropped.insert(0, self._waiting.command)
            self._waiting, self._talk = None, self._talk.settled()
        for command in dropped:
            self._refuse(command, CANCELLED, outcome=Outcome.CANCELLED)

    def has_ended(self, command_id: str, success: bool, error: str) -> None:
        """Note how the executor ended a command; a plan that failed is not given again."""
        turn = next((one for one in self._talk.turns if one.command_id == command_id), None)
        if turn is None:
            return
        outcome = Outcome.SUCCEEDED if success else Outcome.FAILED
        self._talk = self._talk.ended(command_id, outcome, error)
        if not success:
            self.planner.cache.forget(turn.said)

    # --- what goes on ---------------------------------------------------------------------------

    def advance(self) -> None:
        """Go on with what has become possible."""
        self._end_old_question()
        self._end_work()
        while self._queue and self._work is None and self._waiting is None:
            self._begin(self._queue.popleft())
            self._end_work()

    def document(self) -> dict[str, Any]:
        """Return which commands are in work, what was asked, and how it has been going."""
        held = [one.command.command_id for one in (self._work, self._waiting) if one is not None]
        question = self._talk.question
        return {
            **self.accounts.document(),
            "commands": [*held, *(one.command_id for one in self._queue)],
            "question": None if question is None else question.text,
            **self.planner.document(),
        }

    def _begin(self, command: Command) -> None:
        request = self._situation.request(command, self._talk, self.planner.sees)
        if command.plan is not None:
            self._conclude(command, request, self.planner.check_given(command.plan, request))
            return
        recall = Event()
        deadline = Deadline.within(self._clock, self.planner.within_s, recall)
        answer = self.planner.plan_at_once(request, deadline)
        if answer.is_final or not self.planner.slow_rungs:
            self._conclude(command, request, answer)
            return
        self._telling.planning(command, self.planner.slow_rungs)
        future = self._aside.submit(self.planner.plan_slowly, request, deadline, answer)
        self._work = _Work(command=command, request=request, recall=recall, future=future)

    def _end_work(self) -> None:
        work = self._work
        if work is None or not work.future.done():
            return
        self._work = None
        error = work.future.exception()
        if error is not None:  # a fault of ours; the command must not hang for it
            _log.error("planning %r failed", work.command.text, exc_info=error)
            self._refuse(work.command, f"the planner failed: {type(error).__name__}: {error}")
            return
        self._conclude(work.command, work.request, work.future.result())

    def _conclude(self, command: Command, request: Request, answer: Answer) -> None:
        self.accounts.note(answer.attempts)
        self._talk = self._talk.settled()  # what was chosen concerned this command alone
        try:
            if answer.is_final:
                self._situation.check_ready()
            if answer.plan is None:
                raise answer.error or PlanInvalid(["nobody was asked for a plan"])
            question = _read_back(answer) or confirmation_of(answer.plan, request)
            if question:
                raise Ambiguous(question)
            self._hand_on(command, request, answer, answer.plan)
        except Ambiguous as error:
            self._ask(command, request, answer, error)
        except PlanningError as error:
            self._refuse(command, str(error), answer)

    def _hand_on(self, command: Command, request: Request, answer: Answer, plan: Plan) -> None:
        self._telling.handed_on(command, plan, answer)
        self.accounts.planned += 1
        self.planner.accepted(request, answer)
        self._talk = self._talk.after(
            Turn(
                said=command.text,
                command_id=command.command_id,
                told_ns=command.told_ns,
                understood=plan.summary,
                mentioned=mentions_of(plan, request.scene),
                plan=plan,
                here=request.here,
            )
        )

    def _refuse(
        self,
        command: Command,
        reason: str,
        answer: Answer | None = None,
        outcome: Outcome = Outcome.REFUSED,
    ) -> None:
        self.accounts.refused += 1
        self._telling.refused(command, reason, answer)
        turn = Turn(
            said=command.text,
            command_id=command.command_id,
            told_ns=command.told_ns,
            outcome=outcome,
            answer=reason,
        )
        self._talk = self._talk.after(turn)

    # --- questions ------------------------------------------------------------------------------

    def _ask(self, command: Command, request: Request, answer: Answer, error: Ambiguous) -> None:
        question = Question(
            text=error.question,
            asked_ns=self._clock.now_ns(),
            command_id=command.command_id,
            command_text=command.text,
            expression=error.expression,
            candidates=error.candidates,
            choices=request.conversation.choices,
        )
        self.accounts.asked += 1
        self._talk = self._talk.asks(question)
        self._waiting = _Waiting(command=command, answer=answer, plan=answer.plan)
        self._telling.asked(command, question, answer.plan)

    def _is_answer(self, command: Command, waiting: _Waiting) -> bool:
        """Take an utterance as an answer if it can be one; else the question is dropped for it."""
        said = reply(self._talk, command.text, self._clock.now_ns())
        if command.plan is not None or said.verdict is Verdict.ANEW:
            if not command.is_answer:
                self._leave(Says.REPLACED)
                return False
            self._refuse(command, f"that does not answer: {self._question.text}")
            return True
        self._telling.answered(command, waiting.command)
        self._go_on(waiting, said)
        return True

    def _go_on(self, waiting: _Waiting, said: Reply) -> None:
        self._talk = said.conversation
        if said.verdict is Verdict.NO:
            self._leave(Says.LEFT)
        elif said.verdict is Verdict.UNCLEAR:
            self._ask_again(waiting)
        elif waiting.plan is not None:
            self._waiting = None
            self._run_confirmed(waiting, waiting.plan)
        else:
            self._waiting = None
            self._queue.appendleft(waiting.command)

    def _ask_again(self, waiting: _Waiting) -> None:
        if waiting.times_asked >= _MOST_ASKED:
            self._leave(Says.STILL_UNCLEAR)
            return
        self._waiting = replace(waiting, times_asked=waiting.times_asked + 1)
        again = Says.NOT_CLEAR.format(question=self._question.text)
        question = replace(self._question, text=again)
        self._telling.asked(waiting.command, question, waiting.plan)

    def _run_confirmed(self, waiting: _Waiting, plan: Plan) -> None:
        """Check a plan once more: the world may have changed while the person thought."""
        command = waiting.command
        request = self._situation.request(command, self._talk)
        try:
            self._situation.check_ready()
            self._hand_on(command, request, waiting.answer, self.planner.check(plan, request))
        except PlanningError as error:
            self._refuse(command, str(error), waiting.answer)

    def _end_old_question(self) -> None:
        if self._waiting is not None and not self._question.is_open(self._clock.now_ns()):
            self._leave(Says.NO_ANSWER)

    def _leave(self, why: Says) -> None:
        waiting, self._waiting = self._waiting, None
        self._talk = self._talk.settled()
        if waiting is not None:
            self._refuse(waiting.command, why, waiting.answer, Outcome.CANCELLED)

    @property
    def _question(self) -> Question:
        question = self._talk.question
        assert question is not None, "whoever waits has asked"
        return question


def _read_back(answer: Answer) -> str:
    return "" if answer.proposal is None else answer.proposal.read_back
