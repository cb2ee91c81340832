"""Take commands in their order, ask back, wait for answers, and dispatch plans."""

import logging
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from threading import Event
from typing import Final

from drivers.clock import Clock
from vla_deploy.ipc.payloads.tasks import MemoryStatus, PlannerStatus, SetbackEvent
from vla_deploy.planning.dialogue.active_plans import ActivePlans, AsyncPlanner
from vla_deploy.planning.dialogue.asr_nbest_retry import NBestRetry
from vla_deploy.planning.dialogue.command import READ_BACK, PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.confirmation import agreement_to
from vla_deploy.planning.dialogue.dialogue import Dialogue, PendingQuestion
from vla_deploy.planning.dialogue.event_publisher import PlannerEvents
from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.dialogue.turns import Turns
from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanningResult, PlanRequest
from vla_deploy.planning.patterns.follow_up import asked_for, corrected, last_done
from vla_deploy.planning.patterns.steering import (
    denies,
    is_word,
    objects,
    only_objects,
    pauses,
    resumes,
)
from vla_deploy.planning.planner import Planner
from vla_deploy.planning.prohibitions import Prohibitions, read_order
from vla_deploy.planning.recovery.strategies import recover
from vla_deploy.planning.understanding import AnswerVerdict, Candidate, TurnOutcome, judge_answer
from vla_deploy.planning.understanding.conversation import mentions_of
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.plan import Plan
from vla_deploy.robots.plan_bounds import NOT_BOUNDED
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.executors import InlineExecutor

MOST_WAITING: Final = 8
CANCELLED: Final = "cancelled on request"
_log = logging.getLogger(__name__)


class CommandManager:
    """Plan one command at a time; slow planning is done in `executor`, and a stop overtakes it."""

    def __init__(
        self,
        planner: Planner,
        situation: Situation,
        events: PlannerEvents,
        executor: Executor,
        clock: Clock,
        further_plans: int = NOT_BOUNDED.further_plans,
        prohibitions: Prohibitions | None = None,
    ) -> None:
        self.planner = planner
        self._situation = situation
        self._events = events
        self._async = AsyncPlanner(executor)
        self._clock = clock
        self._queue: deque[UserCommand] = deque()
        self._active = ActivePlans(further_plans)
        self._turns = Turns(self._active, situation, events)
        self._retry = NBestRetry(clock)
        self._prohibitions = prohibitions or Prohibitions()
        self.is_paused = False
        """Whether a person has paused the robot, until they let it go on or stop it."""
        self.ends_missions: Callable[[], None] = lambda: None
        self.has_missions: Callable[[], bool] = lambda: False
        self.dialogue = Dialogue(self._accept, situation, events, self._active, clock)
        self.metrics = self.dialogue.metrics

    # --- what comes in --------------------------------------------------------------------------

    def take(self, command: UserCommand) -> None:
        """Take an utterance: the answer to what was asked, or a command of its own."""
        self._guarded(command, partial(self._take, command))

    def pause(self, command: UserCommand, *, pause: bool) -> None:
        """Have all that is carried out come to rest, or go on."""
        is_for_something = self._is_at_something
        self.is_paused = pause and is_for_something
        if self._is_moving:
            self._events.paused(command.command_id, pause=pause)
        else:
            error = "" if is_for_something else "nothing is under way"
            self._events.done(command.command_id, error)
        says = Says.PAUSED if pause else Says.GOES_ON
        self._events.say(command, says if is_for_something else Says.NOTHING_GOES_ON)

    def _take(self, command: UserCommand) -> None:
        pending = self.dialogue.pending
        if pending is None and not command.is_doubted and self._takes_as_pause(command):
            return
        command = self._doubted_yes(command)
        if pending is not None:
            is_taken = self._takes_as_answer(command, pending)
        else:
            is_taken = self._takes_as_word(command)
        if not is_taken and command.is_answer:
            self.dialogue.refuse(command, Says.NOTHING_ASKED)
        elif not is_taken:
            self._take_anew(command)

    def _takes_as_pause(self, command: UserCommand) -> bool:
        """Take "hold on" and "go on" while something is carried out."""
        if self._is_at_something and pauses(command.text):
            self.pause(command, pause=True)
        elif resumes(command.text) and (self.is_paused or self._situation.is_paused):
            self.pause(command, pause=False)
        else:
            return False
        return True

    def _take_anew(self, command: UserCommand) -> None:
        """Take an utterance that answers nothing: a command, an objection, or a correction.

        Whoever objects, corrects or forbids ends all that goes on; what else they want, "don't take
        that, take the blue one", is planned.
        """
        text, forbids = command.text, self._forbids(command)
        corrected = self._correction_of_last(command)
        drops_held = self.dialogue.held is not None and denies(text) and not forbids
        if drops_held or (self._goes_on and (forbids or corrected or objects(text))):
            is_all = only_objects(text) and not (forbids or corrected)
            self.stop_all(command.command_id if is_all else f"{command.command_id}-objects")
            if is_all:
                self._events.say(command, Says.LEFT)
                return
        waiting = (*self._queue, *(one.command for one in self._turns.waiting))
        if sum(not one.mission for one in waiting) >= MOST_WAITING:
            self.dialogue.refuse(command, Says.MANY_WAIT)
            return
        self._queue.append(corrected or command)
        if self._async.command is not None:
            self._events.queued(command, len(self._queue))

    @property
    def _goes_on(self) -> bool:
        """Return whether anything is carried out, planned, or waits for its turn."""
        return self._is_moving or any((self._async.command, self._queue, self._turns.waiting))

    @property
    def _is_moving(self) -> bool:
        """Return whether a plan is carried out, be it one of a planner that has ended since."""
        return bool(self._active) or self._situation.is_executing

    @property
    def in_work(self) -> frozenset[str]:
        """Return the commands that are planned, asked about, carried out, or wait."""
        return frozenset((*self._active.plans, *self._to_be_done()))

    def _to_be_done(self) -> list[str]:
        """Return the commands that are planned, asked about, or wait."""
        open_ones = (self.dialogue.pending, self.dialogue.held)
        commands = (
            self._async.command,
            *(one.command for one in open_ones if one is not None),
            *self._queue,
            *(one.command for one in self._turns.waiting),
        )
        return [one.command_id for one in commands if one is not None]

    @property
    def _is_at_something(self) -> bool:
        return self._goes_on or self.has_missions()

    @property
    def is_at_work(self) -> bool:
        """Return whether anything is carried out, planned or asked, or waits for its turn."""
        return self._goes_on or self.dialogue.pending is not None

    @property
    def carried_out(self) -> frozenset[str]:
        """Return the commands whose plans the executor has, those of an earlier planner too."""
        return frozenset(self._active.plans) | (self._situation.executing or frozenset())

    @property
    def plans_carried_out(self) -> tuple[Plan, ...]:
        """Return the plans that the executor has, as far as this planner knows of them."""
        return tuple(self._active.plans.values())

    def _forbids(self, command: UserCommand) -> bool:
        """Return whether a command forbids something for good, which is safe at once."""
        if command.awaits_word:
            return False
        order = read_order(command.text, self._request(command).world, ())
        return order is not None and order.forbids

    def stop_all(self, command_id: str) -> None:
        """Drop every command, and let the executor end what it does."""
        self.is_paused = False
        self._cancel_all(command_id)
        open_ones = (self.dialogue.settle(), self.dialogue.take_held())
        asked = [one.command for one in open_ones if one is not None]
        dropped = (*asked, self._async.call_off(), *self._queue, *self._turns.clear())
        self._queue.clear()
        for command in dropped:
            if command is not None:
                self.dialogue.refuse(command, CANCELLED, outcome=TurnOutcome.CANCELLED)
        # "Again" after a stop cannot mean what was done before it.
        stop = UserCommand(command_id=command_id, told_ns=self._clock.now_ns(), text="stop")
        self.dialogue.remember(stop, TurnOutcome.CANCELLED)

    def take_part(self, command: UserCommand) -> None:
        """Take a subtask of a mission: no answer, no word, no objection."""
        self._queue.append(command)

    def drop(self, command_id: str) -> None:
        """End one command, wherever it is."""
        asked = self.dialogue.pending
        if asked is not None and asked.command.command_id == command_id:
            self.dialogue.settle()
        self._plan_no_more(command_id)
        self._turns.drop(command_id)
        is_known = self._active.end(command_id) is not None
        if is_known or command_id in (self._situation.executing or ()):
            self._events.cancelled(f"{command_id}-cancel", command_id)

    def _plan_no_more(self, command_id: str) -> None:
        if self._async.command is not None and self._async.command.command_id == command_id:
            self._async.call_off()
        for one in [one for one in self._queue if one.command_id == command_id]:
            self._queue.remove(one)

    def has_ended(self, command_id: str, success: bool, error: str) -> None:
        """Note how the executor ended a command; what is still planned for it is too late."""
        self._plan_no_more(command_id)
        ended = self._active.end(command_id)
        self.dialogue.ended(command_id, success, error)
        if ended is not None and not ended[0].mission:
            self._events.ended(*ended, success, error)

    def turned_away(self, command_id: str, error: str) -> None:
        """Note that the executor does not carry out a plan that it was given."""
        if self._active.end(command_id) is not None:
            self.dialogue.ended(command_id, False, error)

    def set_back(self, command_id: str, setback: SetbackEvent) -> None:
        """Plan a command anew whose plan has failed, before any other, or say that it ends."""
        try:
            self._queue.appendleft(self._active.set_back(command_id, setback))
        except CannotBeDone as error:
            self._events.gave_up(command_id, str(error))

    # --- what goes on ---------------------------------------------------------------------------

    def advance(self) -> None:
        """Go on with what has become possible."""
        self.dialogue.drop_overdue()
        self.is_paused &= self._is_at_something
        self._look_after_job()
        self._look_after_turns()
        while self._queue and self._async.command is None and self.dialogue.pending is None:
            command = self._queue.popleft()
            self._guarded(command, partial(self._begin, command))
            self._look_after_job()

    def document(self, memory: MemoryStatus | None) -> PlannerStatus:
        """Return which commands are in work, what was asked, and the counts; and of `memory`."""
        asked = self.dialogue.pending or self.dialogue.held
        return {
            **self.metrics.document(),
            "commands": self._to_be_done(),
            "question": None if asked is None else asked.question.text,
            **self.planner.document(),
            "prohibitions": self._prohibitions.document(),
            "memory": memory,
        }

    def _begin(self, command: UserCommand) -> None:
        request = self._request(command)
        if command.plan is not None:
            answer = self.planner.check_given(command.plan, request)
            self._settle(PlannedCommand(command, request, answer))
            return
        if command.recovers:
            carried = self._active.of(command.command_id)
            if carried is None:  # it has ended meanwhile
                return
            request = replace(request, failed=carried.history)
            deadline = self._deadline(self.planner.within_s)
            answer = recover(carried, request, self.planner.check)
        else:
            deadline = self._deadline(self._retry.within_s(command, self.planner.within_s))
            answer = self.planner.plan_at_once(request, deadline)
        if not self.planner.goes_on(answer):
            self._conclude(PlannedCommand(command, request, answer))
            return
        self._events.planning(command, self.planner.slow_back_ends)
        planner = self.planner

        def slowly() -> PlannedCommand:
            found = planner.plan_slowly(request, deadline, answer)
            return PlannedCommand(command, request, found)

        self._async.begin(command, deadline, slowly)

    def _deadline(self, within_s: float) -> Deadline:
        return Deadline.within(self._clock, within_s, Event())

    def _look_after_job(self) -> None:
        command, done = self._async.command, self._async.take_done()
        if command is not None and done is not None:
            self._guarded(command, lambda: self._conclude(done.result()))
        tedious = self._async.take_tedious()
        if tedious is not None:
            self._events.say(tedious, Says.WORKING)

    def _conclude(self, done: PlannedCommand) -> None:
        """Conclude a command, or try it next in other words that may have been said."""
        command = done.command
        if command.recovers and self._active.of(command.command_id) is None:
            return  # the executor has given it up meanwhile
        found = self._retry.next(done)
        if isinstance(found, UserCommand):
            self._queue.appendleft(found)
            return
        halts = _stands_still(found) and not found.command.mission
        if halts and self._is_moving:  # nobody needs to be asked about a halt
            self._cancel_all(f"{found.command.command_id}-stops")
        self._settle(found)

    # --- what waits for its turn ----------------------------------------------------------------

    def _settle(self, done: PlannedCommand) -> None:
        """Conclude a command, or let it wait while it would disturb what is carried out."""
        if self._turns.must_wait(done):
            self._turns.put_off(done.command, partial(self._queue.appendleft, done.command))
        else:
            self.dialogue.conclude(done)

    def _look_after_turns(self) -> None:
        """End what the executor does not know of any more, and go on with what waited for it."""
        if not (self._active or self._turns.waiting):
            return
        executing = self._situation.executing
        for command_id in self._active.lost(executing or (), self._clock.now_ns()):
            why = "the executor does not know of it any more"
            self.has_ended(command_id, False, why)
            self._events.lost(command_id, why)
        for turn in reversed(self._turns.take_due()):  # each goes before those that came later
            self._guarded(turn.command, turn.go_on)

    def _guarded(self, command: UserCommand, work: Callable[[], None]) -> None:
        """Do work for one command; a fault of the planner ends that command, and no other."""
        error = InlineExecutor().submit(work).exception()
        if error is not None:
            _log.error("planning %r failed", command.text, exc_info=error)
            self.metrics.failed += 1
            self.dialogue.refuse(command, f"the planner failed: {type(error).__name__}")

    def _cancel_all(self, command_id: str) -> None:
        """Let the executor end what it does; no setback that it tells of by then is mended.

        The person who wanted that needs no answer aloud.
        """
        self.ends_missions()
        self._events.cancelled_all(command_id)
        self._active.end_all()

    def _accept(self, request: PlanRequest, answer: PlanningResult) -> None:
        """Obey an order from now on, whatever planner another profile brings.

        What is under way ends where something is forbidden.
        """
        order = None if answer.proposal is None else answer.proposal.order
        if order is not None:
            self._prohibitions.apply(order)
        if order is not None and order.forbids and self._is_moving:
            self._cancel_all(f"{request.command_id}-forbids")

    def _request(self, command: UserCommand) -> PlanRequest:
        talk = self.dialogue.conversation
        request = self._situation.request(command, talk, of_use=self.planner.uses)
        return replace(request, prohibitions=self._prohibitions.items)

    def _doubted_yes(self, command: UserCommand) -> UserCommand:
        """Return an answer as doubted if it agrees, and may have been a no: "go" sounds like it."""
        waiting = self.dialogue.pending or self.dialogue.held
        if (
            waiting is None
            or judge_answer(waiting.question, command.text)[0] is not AnswerVerdict.YES
        ):
            return command
        others = command.may_have_been()
        if all(judge_answer(waiting.question, one)[0] is not AnswerVerdict.NO for one in others):
            return command
        return replace(command, is_doubted=True, may_ask_again=True)

    def _takes_as_word(self, command: UserCommand) -> bool:
        """Take an utterance as the word that begins the held plan, or drops it."""
        held = self.dialogue.held
        if held is None or held.plan is None:
            return False
        turns, sure = self.dialogue.conversation.turns, not command.is_doubted
        is_last = bool(turns) and turns[-1].command_id == held.command.command_id
        corrected = self._corrected(held, command.text) if is_last and sure else None
        verdict, _ = judge_answer(held.question, command.text)
        begins, drops = is_word(command.text), verdict is AnswerVerdict.NO and not self._goes_on
        if sure and (corrected or drops or (begins and not command.awaits_word)):
            self.dialogue.take_held()
            self._events.answered(command, held.command)
            if corrected is not None:
                self._queue.appendleft(corrected)
            elif drops:
                self.dialogue.drop(held, Says.LEFT)
            else:
                self._run_confirmed(held, held.plan)
        elif begins or verdict is AnswerVerdict.YES:  # "okay", "go when I say so"
            self.dialogue.refuse(command, Says.STILL_HELD)
        else:
            return False
        return True

    # --- answers --------------------------------------------------------------------------------

    def _takes_as_answer(self, command: UserCommand, pending: PendingQuestion) -> bool:
        """Take an utterance as an answer if it can be one; else the question is dropped for it."""
        if command.is_doubted:
            reason = f"heard too badly to answer: {pending.question.text}"
            self.dialogue.refuse(command, reason)
            return True
        asked = pending.command
        if command.is_unsure:
            asked = replace(asked, heard_confidence=READ_BACK)
        if command.awaits_word:  # "the red one, but only when I say so"
            asked = replace(asked, awaits_word=True)
        pending = replace(pending, command=asked)
        verdict, chosen, instead = AnswerVerdict.ANEW, None, None
        if command.plan is None:
            verdict, chosen = self.dialogue.judge(command.text)
        if command.plan is None and verdict in (AnswerVerdict.ANEW, AnswerVerdict.MIXED):
            instead = self._instead_of(pending, command)
            is_command = verdict is AnswerVerdict.ANEW or self._at_once(command).plan is not None
            verdict = AnswerVerdict.ANEW if is_command else AnswerVerdict.UNCLEAR
        if instead is not None:
            self._events.answered(command, asked)
            self.dialogue.settle()
            self._queue.appendleft(instead)
        elif verdict is not AnswerVerdict.ANEW:
            self._events.answered(command, asked)
            self._go_on(pending, verdict, chosen)
        elif command.is_answer:
            self.dialogue.refuse(command, f"that does not answer: {pending.question.text}")
        else:
            self._leave(Says.REPLACED)
            return False
        return True

    def _instead_of(self, pending: PendingQuestion, command: UserCommand) -> UserCommand | None:
        """Return what an utterance that chooses nothing makes of the command that waits, if it is
        about that.
        """
        corrected = self._corrected(pending, command.text)
        if corrected is None and pending.is_open and not self._at_once(command).is_final:
            return replace(pending.command, text=f"{pending.command.text}: {command.text}")
        return corrected

    def _at_once(self, command: UserCommand) -> PlanningResult:
        """Return what words that may be an answer are as a command, without slow planning."""
        deadline = self._deadline(self.planner.within_s)
        return self.planner.plan_at_once(self._request(command), deadline)

    def _go_on(
        self, pending: PendingQuestion, verdict: AnswerVerdict, chosen: Candidate | None
    ) -> None:
        if verdict is AnswerVerdict.NO:
            self._leave(Says.LEFT)
            return
        if verdict is AnswerVerdict.UNCLEAR:
            self.dialogue.ask_again(pending)
            return
        self.dialogue.choose(pending.question, chosen)
        if pending.plan is None:
            self._queue.appendleft(pending.command)
        elif pending.command.awaits_word:
            request = self._request(pending.command)
            self.dialogue.hold(PlannedCommand(pending.command, request, pending.answer))
        else:
            self._run_confirmed(pending, pending.plan)

    def _corrected(self, pending: PendingQuestion, text: str) -> UserCommand | None:
        """Return the command that waits with what a correction puts in the place of something."""
        command, request, plan = pending.command, self._request(pending.command), pending.plan
        told = _correction(command.text, text, plan, request, pending.question.expression)
        if told is None:
            return None
        if plan is not None:  # "the other one" is another than what was asked about
            mentioned = mentions_of(plan, request.scene)
            self.dialogue.remember(command, TurnOutcome.ASKED, mentioned=mentioned)
        return _with_words(command, told)

    def _correction_of_last(self, command: UserCommand) -> UserCommand | None:
        """Return a command as it changes the one before it, None where it does not."""
        if command.is_doubted or command.plan is not None:
            return None
        request = self._request(command)
        waits = self._queue[-1] if self._queue else self._async.command
        last, told = last_done(request), None
        if waits is not None:
            told = _correction(waits.text, command.text, None, request)
        elif last is not None:
            told = _correction(last.said, command.text, last.plan, request)
        return None if told is None else _with_words(command, told)

    def _run_confirmed(self, pending: PendingQuestion, plan: Plan) -> None:
        """Check a plan once more: the world may have changed while the person thought.

        Where it has become a risk that was not agreed to, the person is asked again.
        """
        request = self._request(pending.command)
        done = PlannedCommand(pending.command, request, pending.answer)
        try:
            self._situation.check_ready()
            checked = self.planner.check(plan, request)
            self._situation.check_battery(checked)
        except PlanError as error:
            self.dialogue.refuse(pending.command, error, pending.answer)
            return
        if self._turns.must_wait_with(pending.command, checked):
            self._turns.put_off(pending.command, partial(self._run_confirmed, pending, plan))
            return
        proposal = pending.answer.proposal
        if proposal is None or agreement_to(checked, request) <= agreement_to(plan, request):
            self.dialogue.dispatch(done, checked)
            return
        agreed = replace(proposal, is_unsure=False, left_out=())
        asks = replace(pending.answer, plan=checked, proposal=agreed)
        self.dialogue.conclude(PlannedCommand(pending.command, request, asks))

    def _leave(self, why: Says) -> None:
        self.dialogue.drop(self.dialogue.settle(), why)


def _stands_still(done: PlannedCommand) -> bool:
    """Return whether what was planned begins with standing still, now."""
    plan = done.answer.plan
    return plan is not None and plan.actions[0].skill == "stop" and not done.awaits_word


def _correction(
    command: str, text: str, plan: Plan | None, request: PlanRequest, unclear: str = ""
) -> str | None:
    """Return a command as an utterance corrects its plan, or what was unclear of it."""
    asked = () if plan is None else asked_for(plan)
    about = [one.parameters.get("object") for one in asked] or [unclear]
    return corrected(command, text, about, request.world.places)


def _with_words(command: UserCommand, text: str) -> UserCommand:
    """Return a command in corrected words, of which no other readings are known."""
    return replace(command, text=text, others=(), is_corrected=True)
