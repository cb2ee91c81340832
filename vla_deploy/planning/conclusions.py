"""Bring what was planned for a command to its end: handed on, asked about, or refused."""

from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Final

from vla_deploy.planning.accounts import Accounts
from vla_deploy.planning.command_parser.rung import NAME as COMMAND_PARSER
from vla_deploy.planning.confirmation import agreement_to, confirmation_of
from vla_deploy.planning.dialogue import Dialogue
from vla_deploy.planning.errors import Ambiguous, PlanInvalid, PlanningError
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.interfaces import Answer, Request
from vla_deploy.planning.patterns.backend import Patterns
from vla_deploy.planning.phrasing import Says, spoken_refusal
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.recovery import numbered
from vla_deploy.planning.situation import Situation
from vla_deploy.planning.telling import Telling
from vla_deploy.planning.under_way import UnderWay
from vla_deploy.planning.understanding import Outcome, Turn
from vla_deploy.planning.understanding.mentioned import mentions_of


class Conclusions:
    """Conclude commands, tell of it, and keep it in mind for what is said next.

    `accepted` hears of every plan that is handed on for a command of its own.
    """

    def __init__(
        self,
        accepted: Callable[[Request, Answer], None],
        situation: Situation,
        telling: Telling,
        dialogue: Dialogue,
        under_way: UnderWay,
    ) -> None:
        self.accounts = Accounts()
        self._accepted = accepted
        self._situation = situation
        self._telling = telling
        self._dialogue = dialogue
        self._under_way = under_way

    def conclude(self, command: Command, request: Request, answer: Answer) -> None:
        """Hand a command's plan on where it may run at once; else ask, or say what forbids it."""
        self.accounts.note(answer.attempts)
        self._dialogue.settle()  # what was chosen concerned this command alone
        try:
            if answer.is_final:
                self._situation.check_ready()
            if answer.plan is None:
                raise answer.error or PlanInvalid(["nobody was asked for a plan"])
            self._telling.check_length(answer.plan)
            agreed = self._under_way.agreed(command)
            question = answer.read_back or confirmation_of(answer.plan, request, agreed)
            if question:
                raise Ambiguous(question)
            self.hand_on(command, request, answer, answer.plan)
        except Ambiguous as unclear:
            if command.recovers:  # the robot stands in the middle of it: nobody is asked for long
                self.refuse(command, unclear, answer)
                return
            self.accounts.asked += 1
            waiting = self._dialogue.ask(command, request, answer, unclear)
            self._telling.asked(command, waiting.question, waiting.plan)
        except PlanningError as error:
            self.refuse(command, error, answer)

    def hand_on(self, command: Command, request: Request, answer: Answer, plan: Plan) -> None:
        """Give a checked plan to the executor, and remember what was understood."""
        if command.recovers:
            plan = numbered(plan, len(request.failed))
        self._telling.handed_on(command, plan, answer)
        self._under_way.carry(command, plan, answer, agreement_to(plan, request))
        self.accounts.planned += 1
        if not command.recovers:
            self._accepted(request, answer)
        self._dialogue.remember(
            Turn(
                said=command.text,
                command_id=command.command_id,
                told_ns=command.told_ns,
                understood=plan.summary,
                mentioned=mentions_of(plan, request.scene),
                plan=plan,
                here=request.here,
                in_full=_in_full(plan, answer),
            )
        )

    def refuse(
        self,
        command: Command,
        reason: PlanningError | str,
        answer: Answer | None = None,
        outcome: Outcome = Outcome.REFUSED,
    ) -> None:
        """Say why a command is not done."""
        if command.recovers:
            self._telling.gave_up(command.command_id, str(reason))
            return
        self.accounts.refused += 1
        self._telling.refused(command, str(reason), answer)
        if command.is_doubted:
            self._ask_again(command)
        elif outcome is not Outcome.CANCELLED or isinstance(reason, Says):
            self._telling.aloud(command, spoken_refusal(reason))
        turn = Turn(
            said=command.text,
            command_id=command.command_id,
            told_ns=command.told_ns,
            outcome=outcome,
            answer=str(reason),
        )
        self._dialogue.remember(turn)

    def _ask_again(self, command: Command) -> None:
        """Ask for words that may have been others once more, unless nobody spoke to the robot."""
        if command.may_ask_again:
            self._telling.aloud(command, Says.HEARD_BADLY)


# What of a plan says the command in full words; other models sum it up freely.
_IN_FULL: Final[Mapping[str, Callable[[Plan], str]]] = {
    Patterns.name: attrgetter("goal"),
    COMMAND_PARSER: attrgetter("summary"),
}


def _in_full(plan: Plan, answer: Answer) -> str:
    """Return the words that stand for a command, "" where nobody gave any."""
    rung = answer.proposal.rung if answer.proposal is not None else ""
    return _IN_FULL[rung](plan) if rung in _IN_FULL else ""
