"""Hold the conversation, and the command in it that waits for the person's answer."""

from dataclasses import dataclass, replace
from typing import Final

from drivers.clock import Clock
from vla_deploy.planning.dialogue.command import PlannedCommand, UserCommand
from vla_deploy.planning.dialogue.phrasing import Says
from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.interfaces import PlanningResult
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.understanding import (
    Candidate,
    Conversation,
    Outcome,
    Question,
    Turn,
    Verdict,
    judge_answer,
)

MOST_ASKED: Final = 3
HELD_S: Final = 3600.0
"""How long a plan waits for the word that begins it."""


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


class DialogueState:
    """Remember what was said; at most one question waits at a time.

    Beside it a plan may be `held` until the person says go; what else is said does not drop it.
    """

    def __init__(self, clock: Clock) -> None:
        self.conversation = Conversation()
        self.pending: PendingQuestion | None = None
        self.held: PendingQuestion | None = None
        self._clock = clock

    @property
    def is_overdue(self) -> bool:
        """Return whether the answer to the question would come too late by now."""
        now_ns = self._clock.now_ns()
        return self.pending is not None and not self.pending.question.is_open(now_ns)

    @property
    def is_held_too_long(self) -> bool:
        """Return whether the word that begins the held plan has not come."""
        return self.held is not None and not self.held.question.is_open(self._clock.now_ns())

    def ask(self, done: PlannedCommand, unclear: Ambiguous) -> PendingQuestion:
        """Wait for the answer to a question."""
        question = Question(
            text=unclear.question,
            asked_ns=self._clock.now_ns(),
            command_text=done.command.text,
            expression=unclear.expression,
            candidates=unclear.candidates,
            choices=done.request.conversation.choices,
        )
        self.pending = PendingQuestion(command=done.command, answer=done.answer, question=question)
        return self.pending

    def hold(self, done: PlannedCommand, text: str) -> PendingQuestion:
        """Hold a plan until it is agreed to."""
        now_ns = self._clock.now_ns()
        question = Question(
            text=text, asked_ns=now_ns, command_text=done.command.text, limit_s=HELD_S
        )
        self.held = PendingQuestion(command=done.command, answer=done.answer, question=question)
        return self.held

    def take_held(self) -> PendingQuestion | None:
        """Return what was held, and hold nothing any more."""
        held, self.held = self.held, None
        return held

    def ask_again(self, pending: PendingQuestion) -> Question | None:
        """Wait once more, and return the question in other words; None when that was enough."""
        if pending.times_asked >= MOST_ASKED:
            return None
        asked = replace(pending.question, asked_ns=self._clock.now_ns())
        self.pending = replace(pending, question=asked, times_asked=pending.times_asked + 1)
        return replace(asked, text=Says.NOT_CLEAR.format(question=asked.text))

    def judge(self, text: str) -> tuple[Verdict, Candidate | None]:
        """Return what an utterance is to the question that waits, and which candidate it picks."""
        if self.pending is None or self.is_overdue:
            return Verdict.ANEW, None
        return judge_answer(self.pending.question, text)

    def declines(self, text: object) -> bool:
        """Return whether words such as "never mind" mean the question, and not all that goes on."""
        return isinstance(text, str) and self.judge(text)[0] is Verdict.NO

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

    def remember(self, turn: Turn) -> None:
        """Add a turn to the conversation."""
        self.conversation = self.conversation.after(turn)

    def ended(self, command_id: str, success: bool, error: str) -> Turn | None:
        """Note how a command ended that was carried out, and return its turn if it is known."""
        outcome = Outcome.SUCCEEDED if success else Outcome.FAILED
        self.conversation = self.conversation.ended(command_id, outcome, error)
        turns = self.conversation.turns
        return next((one for one in turns if one.command_id == command_id), None)
