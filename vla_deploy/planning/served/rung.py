"""Plan with one model behind a server; where it is unsure, ask it in several ways and count."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.chat import Chat, Message, Role
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.model_servers.errors import AnswerUnusable, ModelServerError
from vla_deploy.model_servers.picture import Image, small_jpeg
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.one_line import one_line
from vla_deploy.planning.dialogue.phrasing import Says, steps_in_words
from vla_deploy.planning.errors import Ambiguous, CannotBeDone, Declined, PlanningError
from vla_deploy.planning.interfaces import Aid, BackEnd, Check, Proposal, Request
from vla_deploy.planning.prompts.composing import DEFAULT_ROOM, Wish, chat_for
from vla_deploy.planning.prompts.instructions import filled
from vla_deploy.planning.served.candidates import Candidate, chosen
from vla_deploy.planning.served.plan_answer import PlanAnswer, answer_for

SURE: Final = 0.75
"""A plan of which a model is less sure is asked for in other ways, too, then read back."""
_WAYS: Final = ("few_shot", "chain_of_thought", "structured")
_FAULT_CHARACTERS: Final = 400
# Another question takes about as long as the longest before it.
_TIME_MARGIN: Final = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Say how much is asked of a server: plans for one command, and characters of a prompt."""

    candidates: int = 3
    prompt_characters: int = DEFAULT_ROOM


class ServedRung(BackEnd):
    """Ask one server for plans; calls block until the deadline at most."""

    def __init__(
        self,
        server: ModelServer,
        robot: str,
        places: Sequence[str],
        check: Check,
        effort: Effort = Effort(),
    ) -> None:
        self.name = f"server {server.name}"
        self._server = server
        self._robot = robot
        self._check = check
        self._effort = effort
        self._asker = StructuredAsker(server, answer_for(places))
        self.uses = frozenset({Aid.MEMORY, Aid.IMAGE} if self.sees else {Aid.MEMORY})

    @property
    def sees(self) -> bool:
        """Tell whether the model takes images, and may be shown them."""
        settings = self._server.settings
        return settings.vision and (settings.is_local or settings.allow_images_off_robot)

    def document(self) -> dict[str, Any]:
        """Return how the server has been doing."""
        return self._server.document()

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan that most of the model's answers share.

        Raises:
            Declined: the server gives no answer in time, or none that can be read.
            CannotBeDone: the model sees no way, and says why.
            Ambiguous: the model asks something, or what it names is not clear.
            PlanInvalid: what it plans may not run, also after it was told why.
        """
        found: list[Candidate] = []
        asked = 0
        failure: PlanningError = Declined("it was not asked")
        for way in _WAYS[: self._effort.candidates]:
            began_ns = deadline.clock.now_ns()
            asked += 1
            try:
                found.append(self._candidate(request, way, deadline))
            except PlanningError as error:
                failure = error
                if isinstance(error, Ambiguous | _Gone):
                    break
            took_s = (deadline.clock.now_ns() - began_ns) / NS_PER_S
            is_sure = asked == 1 and found and found[0].confidence >= SURE
            if is_sure or deadline.left_s < _TIME_MARGIN * took_s:
                break
        if not found:
            raise failure
        return self._proposal(request, found, asked)

    def _proposal(self, request: Request, found: Sequence[Candidate], asked: int) -> Proposal:
        choice = chosen(found, asked, request.world.places)
        unsure = choice.confidence < SURE
        steps = steps_in_words(choice.candidate.checked)
        return Proposal(
            plan=choice.candidate.plan,
            rung=self.name,
            confidence=choice.confidence,
            read_back=Says.CONFIRM.format(steps=steps) if unsure else "",
            saw_scene=True,
            knows_grammar=True,
            is_momentary=self._shown(request) is not None,
        )

    def _candidate(self, request: Request, way: str, deadline: Deadline) -> Candidate:
        """Return one plan that may run; a model whose plan is refused is told why, once."""
        chat = chat_for(request, self._robot, self._wish(request, way), self._room)
        answer = self._ask(chat, deadline)
        try:
            return self._checked(answer, request)
        except (Ambiguous, CannotBeDone):
            raise
        except PlanningError as error:
            if deadline.left_s <= 0.0:
                raise
            return self._checked(self._ask(_told(chat, answer, error), deadline), request)

    def _ask(self, chat: Chat, deadline: Deadline) -> PlanAnswer:
        try:
            return self._asker.ask(chat, deadline)
        except AnswerUnusable as error:
            raise Declined(one_line(error)) from error
        except ModelServerError as error:
            raise _Gone(one_line(error)) from error

    def _checked(self, answer: PlanAnswer, request: Request) -> Candidate:
        if answer.question:
            raise Ambiguous(answer.question)
        if not answer.feasible or not answer.steps:
            reason = answer.reasoning or "it gives no reason"
            raise CannotBeDone(f"{self.name} sees no way to do it: {reason}")
        plan = answer.plan(request.text)
        checked = self._check(plan, request)
        return Candidate(plan=plan, checked=checked, confidence=answer.confidence)

    def _wish(self, request: Request, way: str) -> Wish:
        image = self._shown(request)
        jpeg = None if image is None else small_jpeg(image)
        return Wish(variant=way, jpeg=jpeg, failed=request.failed)

    def _shown(self, request: Request) -> Image | None:
        return request.image if self.sees else None

    @property
    def _room(self) -> int:
        """Return the characters of a prompt, less those of the schema: it is told in words too."""
        return self._effort.prompt_characters - self._asker.schema_characters


class _Gone(Declined):
    """Say that asking the server again would be in vain."""


def _told(chat: Chat, answer: PlanAnswer, error: PlanningError) -> Chat:
    """Return the conversation that tells a model why its plan was refused, without images."""
    before = tuple(replace(message, images=()) for message in chat.messages)
    said = Message(role=Role.ASSISTANT, text=answer.model_dump_json())
    wish = Message(text=filled("refused", faults=one_line(error)[:_FAULT_CHARACTERS]))
    return replace(chat, messages=(*before, said, wish))
