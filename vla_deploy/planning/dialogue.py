"""Hold the conversation, and the command in it that waits for the person's answer."""

from dataclasses import dataclass, replace
from typing import Final

from drivers.clock import Clock
from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.interfaces import Answer, Request
from vla_deploy.planning.phrasing import Says
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.understanding import (
    Conversation,
    Outcome,
    Question,
    Reply,
    Turn,
    Verdict,
    guess,
    reply,
)

MOST_ASKED: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Waiting:
    """Hold the command that waits for an answer; `plan` is what a yes lets run."""

    command: Command
    answer: Answer
    question: Question
    plan: Plan | None
    times_asked: int = 1

    @property
    def is_open(self) -> bool:
        """Tell whether any words may answer it, rather than yes, no, or one of a few."""
        return self.plan is None and not self.question.candidates


class Dialogue:
    """Remember what was said; at most one question waits at a time."""

    def __init__(self, clock: Clock) -> None:
        self.talk = Conversation()
        self.waiting: Waiting | None = None
        self._clock = clock

    @property
    def is_overdue(self) -> bool:
        """Tell whether the answer to the question would come too late by now."""
        now_ns = self._clock.now_ns()
        return self.waiting is not None and not self.waiting.question.is_open(now_ns)

    def ask(
        self, command: Command, request: Request, answer: Answer, unclear: Ambiguous
    ) -> Waiting:
        """Wait for the answer to a question."""
        question = Question(
            text=unclear.question,
            asked_ns=self._clock.now_ns(),
            command_id=command.command_id,
            command_text=command.text,
            expression=unclear.expression,
            candidates=unclear.candidates,
            choices=request.conversation.choices,
        )
        self.talk = self.talk.asks(question)
        self.waiting = Waiting(command=command, answer=answer, question=question, plan=answer.plan)
        return self.waiting

    def ask_again(self, question: Question) -> Question | None:
        """Wait once more, and return the question in other words; None when that was enough.

        `question` is the one that waits, or what an answer has left of it.
        """
        waiting = self.waiting
        if waiting is None or waiting.times_asked >= MOST_ASKED:
            return None
        asked = replace(question, asked_ns=self._clock.now_ns())
        self.talk = self.talk.asks(asked)
        self.waiting = replace(waiting, question=asked, times_asked=waiting.times_asked + 1)
        return replace(asked, text=Says.NOT_CLEAR.format(question=asked.text))

    def read(self, text: str) -> Reply:
        """Return what an utterance is to the question that waits, changing nothing."""
        return reply(self.talk, text, self._clock.now_ns())

    def guess(self, text: str) -> Reply | None:
        """Return the choice that an utterance seems to make, None where it makes none."""
        return guess(self.talk, text)

    def declines(self, text: object) -> bool:
        """Tell whether words such as "never mind" mean what was asked, and not all that goes on."""
        if self.waiting is None or not isinstance(text, str):
            return False
        return self.read(text).verdict is Verdict.NO

    def settle(self, said: Reply | None = None) -> Waiting | None:
        """Wait no more, and return who waited; what a reply has settled counts from now on."""
        waiting, self.waiting = self.waiting, None
        self.talk = self.talk.settled() if said is None else said.conversation
        return waiting

    def remember(self, turn: Turn) -> None:
        """Add a turn to the conversation."""
        self.talk = self.talk.after(turn)

    def ended(self, command_id: str, success: bool, error: str) -> Turn | None:
        """Note how a command ended that was carried out, and return its turn if it is known."""
        outcome = Outcome.SUCCEEDED if success else Outcome.FAILED
        self.talk = self.talk.ended(command_id, outcome, error)
        return next((one for one in self.talk.turns if one.command_id == command_id), None)
