"""Take commands in their order, ask back, wait for answers, and dispatch plans."""

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
from vla_deploy.planning.dialogue.active_plans import ActivePlans
from vla_deploy.planning.dialogue.asr_nbest_retry import NBestRetry
from vla_deploy.planning.dialogue.async_planner import AsyncPlanner
from vla_deploy.planning.dialogue.command import READ_BACK, PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.confirmation import question_about
from vla_deploy.planning.dialogue.correction import CORRECTED, corrected_by, corrected_text
from vla_deploy.planning.dialogue.dialogue_state import DialogueState, PendingQuestion
from vla_deploy.planning.dialogue.dispatch import CommandDispatcher
from vla_deploy.planning.dialogue.event_publisher import EventPublisher
from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import CannotBeDone, PlanningError
from vla_deploy.planning.interfaces import PlanningResult, Proposal, Request
from vla_deploy.planning.metrics import PlannerMetrics
from vla_deploy.planning.patterns.follow_up import asked_for, last_done
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions
from vla_deploy.planning.recovery.strategies import recover
from vla_deploy.planning.understanding import Outcome, Reply, Turn, Verdict, described, guess
from vla_deploy.planning.understanding.answers import judge_answer
from vla_deploy.planning.understanding.mentioned import mentions_of
from vla_deploy.robots.plan_bounds import NOT_BOUNDED

MOST_WAITING: Final = 8
CANCELLED: Final = "cancelled on request"
_log = logging.getLogger(__name__)


class CommandManager:
    """Plan one command at a time; slow planning is done in `executor`, and a stop overtakes it."""

    def __init__(
        self,
        planner: Planner,
        situation: Situation,
        events: EventPublisher,
        executor: Executor,
        clock: Clock,
        further_plans: int = NOT_BOUNDED.further_plans,
        prohibitions: Prohibitions | None = None,
    ) -> None:
        self.planner = planner
        self.dialogue = DialogueState(clock)
        self._situation = situation
        self._events = events
        self._async = AsyncPlanner(executor)
        self._clock = clock
        self._queue: deque[UserCommand] = deque()
        self._active = ActivePlans(further_plans)
        self._retry = NBestRetry(clock)
        self._prohibitions = prohibitions or Prohibitions()
        self._dispatcher = CommandDispatcher(
            self._accept, situation, events, self.dialogue, self._active
        )

    @property
    def metrics(self) -> PlannerMetrics:
        """Return the counts of commands."""
        return self._dispatcher.metrics

    # --- what comes in --------------------------------------------------------------------------

    def take(self, command: UserCommand) -> None:
        """Take an utterance: the answer to what was asked, or a command of its own."""
        self._guarded(command, partial(self._take, command))

    def _take(self, command: UserCommand) -> None:
        pending = self.dialogue.pending
        if pending is not None and command.is_doubted:
            reason = f"heard too badly to answer: {pending.question.text}"
            self._dispatcher.refuse(command, reason)
        elif (pending is not None and self._takes_as_answer(command, pending)) or (
            pending is None and self._takes_as_word(command)
        ):
            return
        elif command.is_answer:
            self._dispatcher.refuse(command, Says.NOTHING_ASKED)
        elif len(self._queue) >= MOST_WAITING:
            self._dispatcher.refuse(command, Says.MANY_WAIT)
        else:
            self._queue.append(command)
            if self._async.command is not None:
                self._events.queued(command, len(self._queue))

    def stop_all(self, command_id: str) -> None:
        """Drop every command, and let the executor end what it does."""
        self._events.cancelled_all(command_id)
        open_ones = (self.dialogue.settle(), self.dialogue.take_held())
        asked = [one.command for one in open_ones if one is not None]
        dropped = (*asked, self._async.call_off(), *self._queue)
        self._queue.clear()
        self._retry.forget()
        for command in dropped:
            if command is not None:
                self._dispatcher.refuse(command, CANCELLED, outcome=Outcome.CANCELLED)
        # "Again" after a stop cannot mean what was done before it.
        stop = Turn(said="stop", command_id=command_id, outcome=Outcome.CANCELLED)
        self.dialogue.remember(stop)

    def has_ended(self, command_id: str, success: bool, error: str) -> None:
        """Note how the executor ended a command; a plan that failed is not given again."""
        self._active.end(command_id)
        turn = self.dialogue.ended(command_id, success, error)
        self._events.ended(command_id, success, error)
        if turn is not None and not success:
            self.planner.cache.forget(turn.said)

    def turned_away(self, command_id: str, error: str) -> None:
        """Note that the executor does not carry out a plan that it was given."""
        if self._active.of(command_id) is not None:
            self._active.end(command_id)
            self.dialogue.ended(command_id, False, error)

    def set_back(self, command_id: str, setback: Mapping[str, Any]) -> None:
        """Plan a command anew whose plan has failed, before any other, or say that it ends."""
        try:
            self._queue.appendleft(self._active.set_back(command_id, setback))
        except CannotBeDone as error:
            self._events.gave_up(command_id, str(error))

    # --- what goes on ---------------------------------------------------------------------------

    def advance(self) -> None:
        """Go on with what has become possible."""
        if self.dialogue.is_overdue:
            self._leave(Says.NO_ANSWER)
        if self.dialogue.is_held_too_long:
            self._dispatcher.drop(self.dialogue.take_held(), Says.NO_ANSWER)
        self._look_after_job()
        while self._queue and self._async.command is None and self.dialogue.pending is None:
            command = self._queue.popleft()
            self._guarded(command, partial(self._begin, command))
            self._look_after_job()

    def document(self) -> dict[str, Any]:
        """Return which commands are in work, what was asked, and the counts."""
        pending, held = self.dialogue.pending, self.dialogue.held
        waiting = [one.command for one in (pending, held) if one is not None]
        in_work = (self._async.command, *waiting, *self._queue)
        asked = pending or held
        return {
            **self.metrics.document(),
            "commands": [one.command_id for one in in_work if one is not None],
            "question": None if asked is None else asked.question.text,
            **self.planner.document(),
            "prohibitions": self._prohibitions.document(),
        }

    def _begin(self, command: UserCommand) -> None:
        request = self._request(command)
        if command.plan is not None:
            answer = self.planner.check_given(command.plan, request)
            self._dispatcher.conclude(PlannedCommand(command, request, answer))
            return
        if command.recovers:
            carried = self._active.of(command.command_id)
            if carried is None:  # it has ended meanwhile
                return
            request = replace(request, failed=carried.history)
            deadline = self._deadline(self.planner.within_s)
            answer = recover(carried, request, self.planner.check)
        elif plan := command.corrected or self._correction_of_last(command, request):
            self._begin_corrected(command, request, plan)
            return
        else:
            deadline = self._deadline(self._retry.within_s(command, self.planner.within_s))
            answer = self.planner.plan_at_once(request, deadline)
        urgent = self._retry.is_urgent(command) and not answer.is_unchecked
        if urgent or not self.planner.goes_on(answer):
            self._conclude(PlannedCommand(command, request, answer))
            return
        self._events.planning(command, self.planner.slow_back_ends)
        slowly = partial(self.planner.plan_slowly, request, deadline, answer)
        self._async.begin(command, request, deadline, slowly)

    def _deadline(self, within_s: float) -> Deadline:
        return Deadline.within(self._clock, within_s, Event())

    def _look_after_job(self) -> None:
        job = self._async.take_done()
        if job is not None:
            self._guarded(job.command, lambda: self._conclude(job.result()))
        tedious = self._async.take_tedious()
        if tedious is not None:
            self._events.say(tedious, Says.WORKING)

    def _conclude(self, done: PlannedCommand) -> None:
        """Conclude a command, or try it next in other words that may have been said."""
        found = self._retry.next(done)
        if isinstance(found, UserCommand):
            self._queue.appendleft(found)
        else:
            self._dispatcher.conclude(found)

    def _guarded(self, command: UserCommand, work: Callable[[], None]) -> None:
        """Do work for one command; a fault of the planner ends that command, and no other."""
        error = AtOnce().submit(work).exception()
        if error is not None:
            _log.error("planning %r failed", command.text, exc_info=error)
            self.metrics.failed += 1
            self._dispatcher.refuse(command, f"the planner failed: {type(error).__name__}")

    def _accept(self, request: Request, answer: PlanningResult) -> None:
        """Obey an order from now on, whatever planner another profile brings."""
        if answer.proposal is not None and answer.proposal.order is not None:
            self._prohibitions.apply(answer.proposal.order)
        self.planner.accepted(request, answer)

    def _request(self, command: UserCommand) -> Request:
        talk = self.dialogue.conversation
        request = self._situation.request(command, talk, of_use=self.planner.uses)
        return replace(request, prohibitions=self._prohibitions.items)

    def _takes_as_word(self, command: UserCommand) -> bool:
        """Take an utterance as the word that begins the held plan, or drops it."""
        held = self.dialogue.held
        if held is None or held.plan is None or command.is_doubted:
            return False
        verdict, _ = judge_answer(held.question, command.text)
        if verdict not in (Verdict.YES, Verdict.NO):
            return False
        self.dialogue.take_held()
        self._events.answered(command, held.command)
        if verdict is Verdict.YES:
            self._run_confirmed(held, held.plan)
        else:
            self._dispatcher.drop(held, Says.LEFT)
        return True

    # --- answers --------------------------------------------------------------------------------

    def _takes_as_answer(self, command: UserCommand, pending: PendingQuestion) -> bool:
        """Take an utterance as an answer if it can be one; else the question is dropped for it."""
        if command.has_unsure_number:
            doubted = replace(pending.command, heard_confidence=READ_BACK)
            pending = replace(pending, command=doubted)
        go_on = self._continuation(command, pending)
        if go_on is not None:
            self._events.answered(command, pending.command)
            go_on()
        elif command.is_answer:
            self._dispatcher.refuse(command, f"that does not answer: {pending.question.text}")
        else:
            self._leave(Says.REPLACED)
            return False
        return True

    def _continuation(
        self, command: UserCommand, pending: PendingQuestion
    ) -> Callable[[], None] | None:
        """Return how an utterance lets the pending command go on, None where it is no answer."""
        if command.plan is not None:
            return None
        said = self.dialogue.read(command.text)
        full = described(pending.question, command.text)
        if said.verdict is not Verdict.ANEW and not (full and said.verdict is Verdict.UNCLEAR):
            return partial(self._go_on, pending, said)
        if pending.is_open and not self._at_once(command).is_final:
            return partial(self._replan, pending, f"{pending.command.text}: {command.text}")
        if corrected := self._corrected(pending, command.text):
            return partial(self._replace, corrected)
        if full:
            return partial(self._replan, pending, full)
        guessed = guess(self.dialogue.conversation, command.text)
        if guessed and self._at_once(command).plan is None:
            doubted = replace(pending.command, heard_confidence=READ_BACK)
            return partial(self._go_on, replace(pending, command=doubted), guessed)
        return None

    def _at_once(self, command: UserCommand) -> PlanningResult:
        """Return what words that may be an answer are as a command, without slow planning."""
        deadline = self._deadline(self.planner.within_s)
        return self.planner.plan_at_once(self._request(command), deadline)

    def _go_on(self, pending: PendingQuestion, said: Reply) -> None:
        if said.verdict is Verdict.NO:
            self._leave(Says.LEFT)
        elif said.verdict is Verdict.UNCLEAR:
            question = said.conversation.question or pending.question
            asked = self.dialogue.ask_again(pending, question)
            if asked is None:
                self._leave(Says.STILL_UNCLEAR)
            else:
                self._events.asked(pending.command, asked, pending.plan)
        else:
            self.dialogue.settle(said)
            if pending.plan is None:
                self._queue.appendleft(pending.command)
            else:
                self._run_confirmed(pending, pending.plan)

    def _replan(self, pending: PendingQuestion, text: str) -> None:
        """Plan a command anew in the words that an answer makes of it."""
        self._replace(replace(pending.command, text=text))

    def _replace(self, command: UserCommand) -> None:
        """Begin anew with the command that an answer has made of the one that waited."""
        self.dialogue.settle()
        self._queue.appendleft(command)

    def _corrected(self, pending: PendingQuestion, text: str) -> UserCommand | None:
        """Return the command that waits with what a correction puts in the place of something."""
        command, request = pending.command, self._request(pending.command)
        proposal = pending.answer.proposal
        if pending.plan is None or proposal is None:
            told = corrected_text(pending.question, text, request.world.places)
            return None if told is None else replace(command, text=told, corrected=None)
        plan = corrected_by(proposal.plan, text, request.world.places)
        if plan is None:
            return None
        # "The other one" is another than what was asked about.
        asked = mentions_of(pending.plan, request.scene)
        turn = Turn(said=command.text, command_id=command.command_id, mentioned=asked)
        self.dialogue.remember(replace(turn, outcome=Outcome.ASKED))
        return replace(command, corrected=plan)

    def _correction_of_last(self, command: UserCommand, request: Request) -> Plan | None:
        """Return what a command makes of the one before it, which ends where it is under way."""
        last = last_done(request)
        if command.is_doubted or last is None:
            return None
        plan = corrected_by(asked_for(last), command.text, request.world.places)
        if plan is not None and last.outcome is Outcome.UNDER_WAY:
            self._events.cancelled_all(f"{command.command_id}-corrects")
        return plan

    def _begin_corrected(self, command: UserCommand, request: Request, plan: Plan) -> None:
        """Read a plan back that takes the place of the one that was asked about or has begun."""
        proposal = Proposal(plan=plan, back_end=CORRECTED, confidence=1.0)
        try:
            checked = self.planner.check(plan, request)
        except PlanningError as error:
            answer = PlanningResult(error=error)
        else:
            proposal = replace(proposal, read_back=question_about(checked, request))
            answer = PlanningResult(plan=checked, proposal=proposal)
        corrected = replace(command, corrected=plan)
        self._dispatcher.conclude(PlannedCommand(corrected, request, answer))

    def _run_confirmed(self, pending: PendingQuestion, plan: Plan) -> None:
        """Check a plan once more: the world may have changed while the person thought."""
        request = self._request(pending.command)
        done = PlannedCommand(pending.command, request, pending.answer)
        try:
            self._situation.check_ready()
            self._dispatcher.dispatch(done, self.planner.check(plan, request))
        except PlanningError as error:
            self._dispatcher.refuse(pending.command, error, pending.answer)

    def _leave(self, why: Says) -> None:
        self._dispatcher.drop(self.dialogue.settle(), why)
