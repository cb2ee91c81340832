"""Publish what becomes of commands: as events, as plans for the executor, and aloud."""

from typing import Final

from drivers.clock import Clock
from vla_deploy.client.action_status import end_without_actions
from vla_deploy.client.following import lost
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.announcer import Announcer
from vla_deploy.ipc.payloads.tasks import AttemptDocument, PlanEvent, RejectedEvent, TaskEvent
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.dialogue.phrasing import Says, first_part
from vla_deploy.planning.interfaces import PlanningResult
from vla_deploy.planning.understanding import Question
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.plan import Plan

# What a slot of the topic holds, less what stands next to the plan.
MOST_PLAN_BYTES: Final = 28_000
_MOST_REASON_CHARACTERS: Final = 1_500  # of up to four bytes each


class PlannerEvents:
    """Publish the planner's side of every command."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._plans = space.ring_writer(topics.PLAN)
        self._events = space.ring_writer(topics.TASK_EVENT)
        self._voice = Announcer(space, "planner", clock)

    def publish(self, event: TaskEvent) -> None:
        """Publish an event of a mission."""
        self._events.publish(event)

    def done(self, command_id: str, error: str = "") -> None:
        """Publish that what was asked for is done, or why not."""
        self._events.publish(end_without_actions(command_id, error))

    def lost(self, command_id: str, why: str) -> None:
        """Publish the end of a command that no process carries out any more."""
        self._events.publish(lost(command_id, why, {}))

    def say(self, command: UserCommand, text: str) -> None:
        """Say something to a person who gave a command by voice; others read it."""
        if command.is_spoken:
            self._voice.say(text)

    def ended(self, command: UserCommand, plan: Plan, success: bool, error: str) -> None:
        """Say how a command ended that was given by voice, unless its plan has said so."""
        if not success:
            self.say(command, Says.FAILED.format(reason=first_part(error) or "I cannot say why"))
        elif plan.actions[-1].skill != "speak":
            self.say(command, Says.DONE)

    def cancelled_all(self, command_id: str) -> None:
        """Let the executor end what it does."""
        self._plans.publish({"command_id": command_id, "cancel": True})

    def cancelled(self, command_id: str, of: str) -> None:
        """Ask the executor to end one of its commands."""
        self._plans.publish({"command_id": command_id, "cancel": True, "of": of})

    def paused(self, command_id: str, *, pause: bool) -> None:
        """Ask the executor to pause all of its commands, or to resume them."""
        self._plans.publish({"command_id": command_id, "pause": pause})

    def planning(self, command: UserCommand, back_ends: tuple[str, ...]) -> None:
        """Publish that a plan takes time, and which back ends are asked."""
        self._events.publish(
            {"command_id": command.command_id, "event": "planning", "rungs": list(back_ends)}
        )

    def queued(self, command: UserCommand, place: int) -> None:
        """Publish that others are planned first."""
        self._events.publish({"command_id": command.command_id, "event": "queued", "place": place})

    def asked(
        self,
        command: UserCommand,
        question: Question,
        plan: Plan | None,
        choices: tuple[str, ...] = (),
    ) -> None:
        """Ask what only the person knows; `plan` is what a yes, or one of the choices, lets run."""
        self._events.publish(
            {
                "command_id": command.command_id,
                "event": "asked",
                "question": _bounded(question.text),
                "choices": [*choices, *(one.words for one in question.candidates)],
                "answer_within_s": question.limit_s,
                "plan": None if plan is None else plan.model_dump(mode="json"),
            }
        )
        self.say(command, question.text)

    def answered(self, answer: UserCommand, asked: UserCommand) -> None:
        """Publish that an utterance answers a question; more events follow for that command."""
        self._events.publish(
            {"command_id": answer.command_id, "event": "answered", "of": asked.command_id}
        )

    def refused(
        self, command: UserCommand, reason: str, answer: PlanningResult | None = None
    ) -> None:
        """Publish why nothing is done, and what every back end said."""
        event: RejectedEvent = {
            "command_id": command.command_id,
            "event": "rejected",
            "reason": _bounded(reason),
        }
        if answer is not None and answer.attempts:
            event["attempts"] = _attempts(answer)
        self._events.publish(event)

    def gave_up(self, command_id: str, reason: str) -> None:
        """Let the executor end a command for which there is no other plan."""
        self._plans.publish({"command_id": command_id, "give_up": _bounded(reason)})

    def check_length(self, plan: Plan) -> None:
        """Accept a plan that fits into a message.

        Raises:
            PlanInvalid: it is too long.
        """
        length = len(plan.model_dump_json().encode())
        if length > MOST_PLAN_BYTES:
            raise PlanInvalid([f"expected at most {MOST_PLAN_BYTES} bytes of JSON, got {length}"])

    def dispatched(self, command: UserCommand, plan: Plan, answer: PlanningResult) -> None:
        """Give a plan to the executor, and publish which back end made it."""
        document = plan.model_dump(mode="json")
        if not command.recovers:
            self._events.publish({"command_id": command.command_id, "event": "accepted"})
        event: PlanEvent = {"command_id": command.command_id, "event": "plan", "plan": document}
        proposal = answer.proposal
        if proposal is not None:
            event["rung"] = proposal.back_end
            event["confidence"] = round(proposal.confidence, 3)
            if proposal.origin:
                event["origin"] = proposal.origin
        if answer.attempts:
            event["attempts"] = _attempts(answer)
        self._events.publish(event)
        self._plans.publish({"command_id": command.command_id, "plan": document})


def _bounded(reason: str) -> str:
    if len(reason) <= _MOST_REASON_CHARACTERS:
        return reason
    return f"{reason[:_MOST_REASON_CHARACTERS]} ... (and more)"


def _attempts(answer: PlanningResult) -> list[AttemptDocument]:
    return [one.document() for one in answer.attempts]
