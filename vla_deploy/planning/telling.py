"""Tell what becomes of commands: to whoever follows them, to the executor, and aloud."""

from collections import OrderedDict
from typing import Any, Final

from drivers.clock import Clock
from vla_deploy.ipc import RingWriter, SharedSpace
from vla_deploy.ipc.announcer import Announcer
from vla_deploy.planning.errors import PlanInvalid
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.interfaces import Answer
from vla_deploy.planning.phrasing import Says, first_part
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.understanding import Question

# What a slot of the topic holds, less what is told beside the plan.
MOST_PLAN_BYTES: Final = 28_000
_MOST_REASON_CHARACTERS: Final = 1_500  # of up to four bytes each
_MOST_SPOKEN: Final = 16


class Telling:
    """Publish the planner's side of every command."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._plans: RingWriter = space.ring_writer("plan")
        self._events: RingWriter = space.ring_writer("task_event")
        self._voice = Announcer(space, "planner", clock)
        # Commands that came by voice and are carried out now, and whether their plan ends aloud.
        self._spoken: OrderedDict[str, tuple[Command, bool]] = OrderedDict()

    def aloud(self, command: Command, text: str) -> None:
        """Say something to whoever gave a command by voice; others read it."""
        if command.is_spoken:
            self._voice.say(text)

    def ended(self, command_id: str, success: bool, error: str) -> None:
        """Tell aloud how a command ended that was given by voice."""
        command, says_so = self._spoken.pop(command_id, (None, False))
        if command is None:
            return
        if not success:
            self.aloud(command, Says.FAILED.format(reason=first_part(error) or "I cannot say why"))
        elif not says_so:
            self.aloud(command, Says.DONE)

    def cancelled_all(self, command_id: str) -> None:
        """Let the executor end what it does; whoever wanted that need not be told aloud."""
        self._spoken.clear()
        self._plans.publish({"command_id": command_id, "cancel": True})

    def planning(self, command: Command, rungs: tuple[str, ...]) -> None:
        """Tell that a plan takes time, and who is asked."""
        self._tell(command, "planning", rungs=list(rungs))

    def queued(self, command: Command, place: int) -> None:
        """Tell that others are planned first."""
        self._tell(command, "queued", place=place)

    def asked(self, command: Command, question: Question, plan: Plan | None) -> None:
        """Tell what only the person knows; `plan` is what a yes lets run."""
        self._tell(
            command,
            "asked",
            question=_bounded(question.text),
            choices=[one.words for one in question.candidates],
            answer_within_s=question.limit_s,
            plan=None if plan is None else plan.model_dump(mode="json"),
        )
        self.aloud(command, question.text)

    def answered(self, answer: Command, asked: Command) -> None:
        """Tell that an utterance answers a question; what comes of it is told of the command."""
        self._tell(answer, "answered", of=asked.command_id)

    def refused(self, command: Command, reason: str, answer: Answer | None = None) -> None:
        """Tell why nothing is done, and what every rung said."""
        self._tell(command, "rejected", reason=_bounded(reason), **_attempts(answer))

    def gave_up(self, command_id: str, reason: str) -> None:
        """Let the executor end a command for which there is no other plan."""
        self._plans.publish({"command_id": command_id, "give_up": _bounded(reason)})

    def check_length(self, plan: Plan) -> None:
        """Accept a plan that can be told whole.

        Raises:
            PlanInvalid: it is too long.
        """
        length = len(plan.model_dump_json().encode())
        if length > MOST_PLAN_BYTES:
            raise PlanInvalid([f"expected at most {MOST_PLAN_BYTES} bytes of JSON, got {length}"])

    def handed_on(self, command: Command, plan: Plan, answer: Answer) -> None:
        """Give a plan to the executor, and tell who made it."""
        document = plan.model_dump(mode="json")
        told = {"command_id": command.command_id, "event": "plan", "plan": document}
        if not command.recovers:
            self._tell(command, "accepted")
        self._events.publish(told | _maker(answer) | _attempts(answer))
        self._plans.publish({"command_id": command.command_id, "plan": document})
        if command.is_spoken:
            self._spoken[command.command_id] = command, plan.actions[-1].skill == "speak"
            while len(self._spoken) > _MOST_SPOKEN:
                self._spoken.popitem(last=False)

    def _tell(self, command: Command, event: str, **details: Any) -> None:
        self._events.publish({"command_id": command.command_id, "event": event} | details)


def _bounded(reason: str) -> str:
    if len(reason) <= _MOST_REASON_CHARACTERS:
        return reason
    return f"{reason[:_MOST_REASON_CHARACTERS]} ... (and more)"


def _maker(answer: Answer) -> dict[str, Any]:
    proposal = answer.proposal
    if proposal is None:
        return {}
    origin = {"origin": proposal.origin} if proposal.origin else {}
    return {"rung": proposal.rung, "confidence": round(proposal.confidence, 3), **origin}


def _attempts(answer: Answer | None) -> dict[str, Any]:
    if answer is None or not answer.attempts:
        return {}
    return {"attempts": [one.document() for one in answer.attempts]}
