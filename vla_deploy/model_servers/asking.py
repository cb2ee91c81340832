"""Ask a model for an answer of a given shape, and take nothing else."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from vla_deploy.model_servers.chat import Chat, ChatMessage, ChatRole, Completion
from vla_deploy.model_servers.errors import (
    AnswerInvalid,
    AnswerMalformed,
    AnswerUnusable,
    ServerFailed,
    ServerRefused,
)
from vla_deploy.model_servers.json_answer import objects_in
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.runtime.deadline import Deadline

Shape = TypeVar("Shape", bound=BaseModel)
# How servers say that they do not know a mode; one fails with 500 instead.
_MODE_UNKNOWN: Final = frozenset({400, 404, 415, 422, 500, 501})
_MOST_FAULTS: Final = 8
# What is wrong with a long answer is seen from its beginning.
_ECHOED_CHARACTERS: Final = 8_000
_REPAIRABLE: Final = (AnswerMalformed, AnswerInvalid)


class StructuredAsker(Generic[Shape]):
    """Ask one server for one shape; it remembers which way of asking the server understands."""

    def __init__(self, server: ModelServer, shape: type[Shape]) -> None:
        self._server = server
        self._shape = shape
        self._schema = shape.model_json_schema()
        self._mode: str | None = None

    @property
    def schema_mode(self) -> str:
        """Return how the server is asked now."""
        return self._mode or self._server.format.schema_modes[0]

    @property
    def schema_characters(self) -> int:
        """Return how long the schema is that every question carries in words."""
        return len(_in_words(self._schema))

    def ask(self, chat: Chat, deadline: Deadline | None = None) -> Shape:
        """Return the model's answer; one of the wrong shape is sent back once, with its faults.

        Raises:
            PrivacyRefused: that may not leave the robot.
            ServerRefused: the server will not answer this.
            Unavailable: there is no answer now.
            AnswerUnusable: also after the repair, it has the wrong shape.
        """
        ends = deadline or self._server.deadline()
        asked = replace(chat, schema=self._schema, system=_with_schema(chat.system, self._schema))
        text = self._complete(asked, ends).text
        try:
            return self._read(text)
        except _REPAIRABLE as error:
            asked = _repair(asked, text, error)
        return self._read(self._complete(asked, ends).text)

    def _complete(self, chat: Chat, ends: Deadline) -> Completion:
        """Ask in the strictest mode that the server takes, and remember it."""
        if self._mode is not None:
            return self._server.complete(chat, self._mode, ends)
        modes = self._server.format.schema_modes
        for mode in modes:
            final = frozenset[int]() if mode == modes[-1] else _MODE_UNKNOWN
            try:
                completion = self._server.complete(chat, mode, ends, final)
            except (ServerRefused, ServerFailed) as error:
                if error.status not in final:
                    raise
                continue
            self._mode = mode
            return completion
        raise AssertionError("the last mode returns or raises")

    def _read(self, text: str) -> Shape:
        """Take the last object that has the shape: models correct themselves towards the end."""
        faults: tuple[str, ...] = ()
        for candidate in reversed(objects_in(text)):
            try:
                return self._shape.model_validate(candidate)
            except ValidationError as error:
                faults = faults or _faults(error)
        raise AnswerInvalid(faults)


def _faults(error: ValidationError) -> tuple[str, ...]:
    found = error.errors(include_url=False, include_input=False)[:_MOST_FAULTS]
    return tuple(f"{'.'.join(map(str, one['loc'])) or 'answer'}: {one['msg']}" for one in found)


def _with_schema(system: str, schema: Mapping[str, Any]) -> str:
    """Say the schema in words too: not every server enforces it, and none its bounds."""
    return f"{system}\n\n{_in_words(schema)}".lstrip()


def _in_words(schema: Mapping[str, Any]) -> str:
    text = json.dumps(schema, ensure_ascii=False, separators=(",", ":"))
    wish = "Answer with one JSON object and nothing else. It must follow this JSON Schema:"
    return f"{wish}\n{text}"


def _repair(chat: Chat, text: str, error: AnswerUnusable) -> Chat:
    """Return the conversation that sends an answer back, without images: its form is wrong."""
    before = tuple(replace(message, images=()) for message in chat.messages)
    said = ChatMessage(role=ChatRole.ASSISTANT, text=text[:_ECHOED_CHARACTERS])
    wish = ChatMessage(
        text=f"That cannot be used: {error}. Answer again with the JSON object only."
    )
    return replace(chat, messages=(*before, said, wish))
