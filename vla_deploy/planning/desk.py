"""Take commands in their order, ask back, wait for answers, and hand plans on."""

import logging
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from threading import Event
from typing import Any, Final

from drivers.clock import Clock
from vla_deploy.aside import AtOnce
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.accounts import Accounts
from vla_deploy.planning.asking import Proposal, Request
from vla_deploy.planning.beside import Beside
from vla_deploy.planning.conclusions import Conclusions
from vla_deploy.planning.correction import CORRECTED, corrected_by
from vla_deploy.planning.dialogue import Dialogue, Waiting
from vla_deploy.planning.errors import PlanningError
from vla_deploy.planning.inbox import READ_BACK, Command
from vla_deploy.planning.ladder import Answer
from vla_deploy.planning.phrasing import Says
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions
from vla_deploy.planning.recovery import recover
from vla_deploy.planning.rehearing import Rehearing
from vla_deploy.planning.situation import Situation
from vla_deploy.planning.telling import Telling
from vla_deploy.planning.under_way import UnderWay
from vla_deploy.planning.understanding import Outcome, Question, Reply, Turn, Verdict, described
from vla_deploy.robots.plan_bounds import NOT_BOUNDED

MOST_WAITING: Final = 8
CANCELLED: Final = "cancelled on request"
_log = logging.getLogger(__name__)


class Desk:
    """Plan one command at a time; what takes time is done in `aside`, and a stop overtakes it."""

    def __init__(
        self,
        planner: Planner,
        situation: Situation,
        telling: Telling,
        aside: Executor,
        clock: Clock,
        further_plans: int = NOT_BOUNDED.further_plans,
        prohibitions: Prohibitions | None = None,
    ) -> None:
        self.planner = planner
        self.dialogue = Dialogue(clock)
        self._situation = situation
        self._telling = telling
        self._beside = Beside(aside, clock)
        self._clock = clock
        self._queue: deque[Command] = deque()
        self._under_way = UnderWay(further_plans)
        self._rehearing = Rehearing(clock)
        self._prohibitions = prohibitions or Prohibitions()
        self._conclusions = Conclusions(
            self._accept,
            situation,
            telling,
            self.dialogue,
            self._under_way,
        )

    @property
    def accounts(self) -> Accounts:
        """Return how it has been going."""
        return self._conclusions.accounts

    # --- what comes in --------------------------------------------------------------------------

    def take(self, command: Command) -> None:
        """Take an utterance: the answer to what was asked, or a command of its own."""
        self._guarded(command, partial(self._take, command))

    def _take(self, command: Command) -> None:
        waiting = self.dialogue.waiting
        if waiting is not None and command.is_doubted:
            self._conclusions.refuse(command, f"heard too badly to answer: {waiting.question.text}")
            return
        if waiting is not None and self._is_answer(command, waiting):
            return
        if command.is_answer:
            self._conclusions.refuse(command, Says.NOTHING_ASKED)
        elif len(self._queue) >= MOST_WAITING:
            self._conclusions.refuse(command, Says.MANY_WAIT)
        else:
            self._queue.append(command)
            if self._beside.work is not None:
                self._telling.queued(command, len(self._queue))

    def stop_all(self, command_id: str) -> None:
        """Let go of every command, and let the executor end what it does."""
        self._telling.cancelled_all(command_id)
        waiting = self.dialogue.settle()
        asked = None if waiting is None else waiting.command
        dropped = (asked, self._beside.call_in(), *self._queue)
        self._queue.clear()
        self._rehearing.forget()
        for command in dropped:
            if command is not None:
                self._conclusions.refuse(command, CANCELLED, outcome=Outcome.CANCELLED)
        # Who says "again" after a stop cannot mean what was done before it.
        stop = Turn(said="stop", command_id=command_id, outcome=Outcome.CANCELLED)
        self.dialogue.remember(stop)

    def has_ended(self, command_id: str, success: bool, error: str) -> None:
        """Note how the executor ended a command; a plan that failed is not given again."""
        self._under_way.ended(command_id)
        turn = self.dialogue.ended(command_id, success, error)
        self._telling.ended(command_id, success, error)
        if turn is not None and not success:
            self.planner.cache.forget(turn.said)

    def turned_away(self, command_id: str, error: str) -> None:
        """Note that the executor does not carry out a plan that it was given."""
        if self._under_way.carried(command_id) is not None:
            self._under_way.ended(command_id)
            self.dialogue.ended(command_id, False, error)

    def set_back(self, command_id: str, told: Mapping[str, Any]) -> None:
        """Plan a command anew whose plan has failed, before any other, or say that it ends."""
        found = self._under_way.set_back(command_id, told)
        if isinstance(found, str):
            self._telling.gave_up(command_id, found)
        else:
            self._queue.appendleft(found)

    # --- what goes on ---------------------------------------------------------------------------

    def advance(self) -> None:
        """Go on with what has become possible."""
        if self.dialogue.is_overdue:
            self._leave(Says.NO_ANSWER)
        self._look_after_work()
        while self._queue and self._beside.work is None and self.dialogue.waiting is None:
            command = self._queue.popleft()
            self._guarded(command, partial(self._begin, command))
            self._look_after_work()

    def document(self) -> dict[str, Any]:
        """Return which commands are in work, what was asked, and how it has been going."""
        waiting = self.dialogue.waiting
        held = [one.command for one in (self._beside.work, waiting) if one is not None]
        return {
            **self.accounts.document(),
            "commands": [one.command_id for one in (*held, *self._queue)],
            "question": None if waiting is None else waiting.question.text,
            **self.planner.document(),
            "prohibitions": self._prohibitions.document(),
        }

    def _begin(self, command: Command) -> None:
        request = self._request(command)
        if command.recovers:
            self._begin_recovery(command, request)
            return
        if command.plan is not None:
            self._conclusions.conclude(
                command, request, self.planner.check_given(command.plan, request)
            )
            return
        within_s = self._rehearing.within_s(command, self.planner.within_s)
        deadline = Deadline.within(self._clock, within_s, Event())
        self._go_slowly(command, request, self.planner.plan_at_once(request, deadline), deadline)

    def _go_slowly(
        self, command: Command, request: Request, answer: Answer, deadline: Deadline
    ) -> None:
        """Ask those who take time, where nobody else has a plan."""
        at_once = not self.planner.slow_rungs or self._rehearing.is_urgent(command)
        if answer.is_final or at_once:
            self._conclude(command, request, answer)
            return
        self._telling.planning(command, self.planner.slow_rungs)
        slowly = partial(self.planner.plan_slowly, request, deadline, answer)
        self._beside.begin(command, request, deadline, slowly)

    def _conclude(self, command: Command, request: Request, answer: Answer) -> None:
        """Conclude a command, or try it next in other words that may have been said."""
        other = self._rehearing.other(command, request, answer)
        if other is not None:
            self._queue.appendleft(other)
            return
        heard = self._rehearing.concluded(command, request, answer)
        self._conclusions.conclude(heard.command, heard.request, heard.answer)

    def _begin_recovery(self, command: Command, request: Request) -> None:
        carried = self._under_way.carried(command.command_id)
        if carried is None:  # it has ended meanwhile
            return
        request = replace(request, failed=carried.history)
        deadline = Deadline.within(self._clock, self.planner.within_s, Event())
        answer = recover(carried, request, self.planner.check)
        self._go_slowly(command, request, answer, deadline)

    def _look_after_work(self) -> None:
        done = self._beside.take_done()
        if done is not None:
            self._guarded(
                done.command,
                lambda: self._conclude(done.command, done.request, done.future.result()),
            )
        tedious = self._beside.take_tedious()
        if tedious is not None:
            self._telling.aloud(tedious, Says.WORKING)

    def _guarded(self, command: Command, work: Callable[[], None]) -> None:
        """Do work for one command; a fault of ours ends that command, and neither others nor us."""
        error = AtOnce().submit(work).exception()
        if error is not None:
            _log.error("planning %r failed", command.text, exc_info=error)
            self.accounts.failed += 1
            self._conclusions.refuse(command, f"the planner failed: {type(error).__name__}")

    def _accept(self, request: Request, answer: Answer) -> None:
        """Obey an order from now on, whatever planner another profile brings."""
        if answer.proposal is not None and answer.proposal.order is not None:
            self._prohibitions.apply(answer.proposal.order)
        self.planner.accepted(request, answer)

    def _request(self, command: Command) -> Request:
        request = self._situation.request(command, self.dialogue.talk, of_use=self.planner.uses)
        return replace(request, prohibitions=self._prohibitions.items)

    # --- answers --------------------------------------------------------------------------------

    def _is_answer(self, command: Command, waiting: Waiting) -> bool:
        """Take an utterance as an answer if it can be one; else the question is dropped for it."""
        if command.has_unsure_number:
            doubted = replace(waiting.command, heard_confidence=READ_BACK)
            waiting = replace(waiting, command=doubted)
        said = self.dialogue.read(command.text)
        full = described(waiting.question, command.text)
        is_reply = command.plan is None and said.verdict is not Verdict.ANEW
        if is_reply and not (full and said.verdict is Verdict.UNCLEAR):
            self._telling.answered(command, waiting.command)
            self._go_on(waiting, said)
        elif waiting.is_open and not self._is_command(command):
            self._telling.answered(command, waiting.command)
            self._complete(waiting, command.text)
        elif plan := corrected_by(waiting.plan, command.text):
            self._telling.answered(command, waiting.command)
            self._correct(waiting, plan)
        elif full:
            self._telling.answered(command, waiting.command)
            self.dialogue.settle()
            self._queue.appendleft(replace(waiting.command, text=full))
        elif (guess := self.dialogue.guess(command.text)) and not self._has_plan(command):
            self._telling.answered(command, waiting.command)
            doubted = replace(waiting.command, heard_confidence=READ_BACK)
            self._go_on(replace(waiting, command=doubted), guess)
        elif command.is_answer:
            self._conclusions.refuse(command, f"that does not answer: {waiting.question.text}")
        else:
            self._leave(Says.REPLACED)
            return False
        return True

    def _go_on(self, waiting: Waiting, said: Reply) -> None:
        if said.verdict is Verdict.NO:
            self._leave(Says.LEFT)
        elif said.verdict is Verdict.UNCLEAR:
            self._ask_again(waiting, said.conversation.question or waiting.question)
        elif waiting.plan is not None:
            self.dialogue.settle(said)
            self._run_confirmed(waiting, waiting.plan)
        else:
            self.dialogue.settle(said)
            self._queue.appendleft(waiting.command)

    def _is_command(self, command: Command) -> bool:
        """Tell whether words that could answer anything are a command to whoever takes no time."""
        return command.plan is not None or self._at_once(command).is_final

    def _has_plan(self, command: Command) -> bool:
        """Tell whether whoever takes no time has a plan for words that may be an answer."""
        return command.plan is not None or self._at_once(command).plan is not None

    def _at_once(self, command: Command) -> Answer:
        deadline = Deadline.within(self._clock, self.planner.within_s)
        return self.planner.plan_at_once(self._request(command), deadline)

    def _complete(self, waiting: Waiting, text: str) -> None:
        """Plan a command anew together with what answers a question that a model has asked."""
        self.dialogue.settle()
        asked = waiting.command
        self._queue.appendleft(replace(asked, text=f"{asked.text}: {text}"))

    def _correct(self, waiting: Waiting, plan: Plan) -> None:
        """Go on with another plan in the place of the one that was read back."""
        self.dialogue.settle()
        command = waiting.command
        request = self._request(command)
        proposal = Proposal(plan=plan, rung=CORRECTED, confidence=1.0)
        try:
            checked = self.planner.check(plan, request)
        except PlanningError as error:
            self._conclusions.conclude(command, request, Answer(error=error))
            return
        self._conclusions.conclude(command, request, Answer(plan=checked, proposal=proposal))

    def _ask_again(self, waiting: Waiting, question: Question) -> None:
        asked = self.dialogue.ask_again(question)
        if asked is None:
            self._leave(Says.STILL_UNCLEAR)
            return
        self._telling.asked(waiting.command, asked, waiting.plan)

    def _run_confirmed(self, waiting: Waiting, plan: Plan) -> None:
        """Check a plan once more: the world may have changed while the person thought."""
        command = waiting.command
        request = self._request(command)
        try:
            self._situation.check_ready()
            self._conclusions.hand_on(
                command, request, waiting.answer, self.planner.check(plan, request)
            )
        except PlanningError as error:
            self._conclusions.refuse(command, error, waiting.answer)

    def _leave(self, why: Says) -> None:
        waiting = self.dialogue.settle()
        if waiting is not None:
            self._conclusions.refuse(waiting.command, why, waiting.answer, Outcome.CANCELLED)
