"""Plan by a language model on board: the same questions as to a server, the answer constrained."""

import math
from typing import Final

from pydantic import ValidationError

from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.memory_claims import MemoryClaim
from vla_deploy.model_servers.chat import Chat
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.one_line import one_line
from vla_deploy.planning.chat_models.chat_back_end import ChatBackEnd
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.interfaces import Proposal, Request
from vla_deploy.planning.language_model import (
    AnswerBounds,
    LanguageModel,
    Message,
    ModelAnswer,
)
from vla_deploy.planning.prompts.composing import chat_for
from vla_deploy.robots import RobotDescription

# English has about four characters to a token; what is left of the context is for the answer.
_CHARACTERS_PER_TOKEN: Final = 3
_MOST_ROOM: Final = 12_000


class LocalModel(ChatBackEnd):
    """Ask one model on board for plans."""

    def __init__(self, name: str, model: LanguageModel, robot: RobotDescription) -> None:
        super().__init__(name, robot.name, sorted(robot.places))
        self.model = model
        self.claim = MemoryClaim()
        self._schema = self.shape.model_json_schema()
        free_tokens = model.config.context_tokens - model.language.most_tokens
        self._room = min(_MOST_ROOM, _CHARACTERS_PER_TOKEN * free_tokens)

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan that the model finds likeliest.

        Raises:
            Declined: it gives no whole answer in time, or none that can be read.
            CannotBeDone: the model sees no way, and says why.
            Ambiguous: the model asks something.
        """
        chat = chat_for(request, self.robot, "structured", self._room)
        bounds = AnswerBounds(deadline=deadline, most_tokens=self.model.language.most_tokens)
        try:
            answer = self.model.answer(messages_of(chat), bounds, self._schema)
            found = self.shape.model_validate_json(answer.text)
        except InferenceError as error:
            raise Declined(one_line(error)) from error
        except ValidationError as error:
            raise Declined(f"its answer cannot be read: {one_line(error)}") from error
        plan = self.planned(found, request)
        return self.proposal(plan, min(found.confidence, certainty_of(answer)))

    def close(self) -> None:
        """Release the memory."""
        self.model.close()
        self.claim.release()


def certainty_of(answer: ModelAnswer) -> float:
    """Return the geometric mean of the probabilities of the tokens that were chosen."""
    chosen = answer.chosen
    return math.exp(sum(chosen) / len(chosen)) if chosen else 1.0


def messages_of(chat: Chat) -> list[Message]:
    """Return a question as chat templates take it; images are left out."""
    turns: list[Message] = [{"role": one.role.value, "content": one.text} for one in chat.messages]
    return [{"role": "system", "content": chat.system}, *turns] if chat.system else turns
