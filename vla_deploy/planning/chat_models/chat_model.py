"""Plan with a chat model, on board or behind a server: one prompt, one answer, one repair."""

import math
from abc import abstractmethod
from dataclasses import replace
from typing import Any, Final

from pydantic import ValidationError

from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.language_model import AnswerBounds, LanguageModel
from vla_deploy.inference.memory_claims import MemoryClaim
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.calls.picture import small_jpeg
from vla_deploy.model_servers.chat import Chat, ChatMessage, ChatRole
from vla_deploy.model_servers.errors import ModelServerError
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.planning.chat_models.plan_answer import PlanAnswer
from vla_deploy.planning.errors import Ambiguous, CannotBeDone, Declined
from vla_deploy.planning.interfaces import Aid, BackEnd, Check, PlanRequest, Proposal
from vla_deploy.planning.prompts.composing import ROOM, chat_for, filled
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.plan import Plan
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.one_line import one_line

SURE: Final = 0.75
"""A plan of which a model is less sure is read back before anything moves."""
_FAULT_CHARACTERS: Final = 400
# English has about four characters to a token; what is left of the context is for the answer.
_CHARACTERS_PER_TOKEN: Final = 3


class ChatModel(BackEnd):
    """Ask one chat model for plans; calls block until the deadline at most.

    A prompt has at most `room` characters.
    """

    is_language_model = True
    is_trusted = True
    """A plan of it may run without a person's yes where it says that it is sure."""
    uses = frozenset({Aid.MEMORY})
    room = ROOM

    def __init__(self, name: str, robot: str, shape: type[PlanAnswer], check: Check) -> None:
        self.name = name
        self.shape = shape
        self._robot = robot
        self._check = check

    @abstractmethod
    def ask(self, chat: Chat, deadline: Deadline) -> PlanAnswer:
        """Return the model's answer.

        Raises:
            Declined: it gives none in time, or none that can be read.
        """

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        """Return the plan that the model answers; one that is refused is sent back once.

        Raises:
            Declined: it gives no answer in time, or none that can be read.
            CannotBeDone: the model sees no way, and says why.
            Ambiguous: the model asks something, or what it names is not clear.
            PlanError: what it plans may not run, also after it was sent the reason.
        """
        image = request.image if Aid.IMAGE in self.uses else None
        jpeg = None if image is None else small_jpeg(image)
        chat = chat_for(request, self._robot, self.room, jpeg)
        answer = self.ask(chat, deadline)
        try:
            return self._proposal(answer, request)
        except (Ambiguous, CannotBeDone):
            raise
        except PlanError as error:
            if deadline.left_s <= 0.0:
                raise
            return self._proposal(self.ask(_refused(chat, answer, error), deadline), request)

    def _proposal(self, answer: PlanAnswer, request: PlanRequest) -> Proposal:
        if answer.question:
            raise Ambiguous(answer.question)
        if not answer.feasible or not answer.steps:
            reason = answer.reasoning or "it gives no reason"
            raise CannotBeDone(f"{self.name} sees no way to do it: {reason}")
        plan = answer.plan(request.text)
        self._check(plan, request)
        return Proposal(
            plan=plan,
            back_end=self.name,
            confidence=round(answer.confidence, 3),
            is_unsure=answer.confidence < SURE or (not self.is_trusted and _moves(plan)),
            knows_grammar=True,
        )


class LocalModel(ChatModel):
    """Ask a model on board, whose answer is constrained to the shape; images are left out."""

    def __init__(
        self, name: str, model: LanguageModel, robot: str, shape: type[PlanAnswer], check: Check
    ) -> None:
        super().__init__(name, robot, shape, check)
        self.model = model
        self.claim = MemoryClaim()
        self._schema = self.shape.model_json_schema()
        free_tokens = model.config.context_tokens - model.language.most_tokens
        self.room = min(ROOM, _CHARACTERS_PER_TOKEN * free_tokens)

    def ask(self, chat: Chat, deadline: Deadline) -> PlanAnswer:
        """Return the likeliest answer, as sure as the model says and its tokens are likely."""
        turns = [{"role": one.role.value, "content": one.text} for one in chat.messages]
        bounds = AnswerBounds(deadline=deadline, most_tokens=self.model.language.most_tokens)
        try:
            answer = self.model.answer(
                [{"role": "system", "content": chat.system}, *turns], bounds, self._schema
            )
            found = self.shape.model_validate_json(answer.text)
        except InferenceError as error:
            raise Declined(one_line(error)) from error
        except ValidationError as error:
            raise Declined(f"its answer cannot be read: {one_line(error)}") from error
        likely = math.exp(sum(answer.chosen) / max(1, len(answer.chosen)))
        return found.model_copy(update={"confidence": min(found.confidence, likely)})

    def close(self) -> None:
        """Release the memory."""
        self.model.close()
        self.claim.release()


class ServedModel(ChatModel):
    """Ask a server, which is shown images where its model takes them and `servers.toml` lets it."""

    def __init__(
        self, server: ModelServer, robot: str, shape: type[PlanAnswer], check: Check
    ) -> None:
        super().__init__(f"server {server.name}", robot, shape, check)
        self._server = server
        self._asker = StructuredAsker(server, self.shape)
        # The schema is a part of the prompt, too.
        self.room = ROOM - self._asker.schema_characters
        settings = server.settings
        self.is_trusted = settings.trust_plans
        if settings.vision and (settings.is_local or settings.allow_images_off_robot):
            self.uses = frozenset({Aid.MEMORY, Aid.IMAGE})

    def ask(self, chat: Chat, deadline: Deadline) -> PlanAnswer:
        """Return the server's answer; the asker sends one of a wrong shape back once."""
        try:
            return self._asker.ask(chat, deadline)
        except ModelServerError as error:
            raise Declined(one_line(error)) from error

    def document(self) -> dict[str, Any]:
        """Return how the server has been doing."""
        return self._server.document()


def _moves(plan: Plan) -> bool:
    return any(action.skill not in MOTIONLESS for action in plan.actions)


def _refused(chat: Chat, answer: PlanAnswer, error: PlanError) -> Chat:
    """Return the conversation that says why a model's plan was refused, without images."""
    before = tuple(replace(message, images=()) for message in chat.messages)
    said = ChatMessage(role=ChatRole.ASSISTANT, text=answer.model_dump_json())
    wish = ChatMessage(text=filled("refused", faults=one_line(error)[:_FAULT_CHARACTERS]))
    return replace(chat, messages=(*before, said, wish))
