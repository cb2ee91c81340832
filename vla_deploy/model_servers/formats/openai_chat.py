"""Speak OpenAI's chat completions, as OpenAI does and as llama-server, vLLM and Ollama do."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.model_servers.chat import Chat, ChatMessage, Completion
from vla_deploy.model_servers.errors import AnswerMalformed, AnswerRefused, AnswerTruncated
from vla_deploy.model_servers.formats.base import (
    Json,
    ModelFacts,
    WireRequest,
    base64_text,
    bearer,
    count,
    is_closed,
    known_names,
    part,
    wire_schema,
)
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.secret import Secret

JSON_SCHEMA: Final = "json_schema"
# llama-cpp-python's server fails on `json_schema`, and takes the schema here instead.
JSON_OBJECT: Final = "json_object"
WORDS: Final = "words"


class OpenAiChat:
    """Speak the language of `/chat/completions`.

    `tokens_key` is how the bound of tokens is called: OpenAI has a new name that not all of the
    compatible servers know.
    """

    schema_modes: tuple[str, ...] = (JSON_SCHEMA, JSON_OBJECT, WORDS)

    def __init__(self, tokens_key: str) -> None:
        self._tokens_key = tokens_key

    def headers(self, key: Secret | None) -> dict[str, str]:
        """Return the key's header, none where the server wants no key."""
        return bearer(key)

    def request(self, settings: ServerSettings, chat: Chat, mode: str) -> WireRequest:
        """Return the request for a question."""
        system = [{"role": "system", "content": chat.system}] if chat.system else []
        body: Json = {
            "model": settings.model,
            "messages": [*system, *map(_turn, chat.messages)],
            self._tokens_key: settings.max_answer_tokens,
        }
        if settings.temperature is not None:
            body["temperature"] = settings.temperature
        if chat.schema is not None and mode != WORDS:
            body["response_format"] = _response_format(chat, chat.schema, mode)
        return WireRequest(path="/chat/completions", body=body)

    def completion(self, reply: Json) -> Completion:
        """Read a reply."""
        choice = part(reply, "choices", 0)
        message = part(choice, "message")
        refusal = message.get("refusal") if isinstance(message, dict) else None
        ended = choice.get("finish_reason")
        if refusal or ended == "content_filter":
            raise AnswerRefused(f"the model declines: {refusal or 'filtered content'!s:.200}")
        if ended == "length":
            raise AnswerTruncated("the model ran out of tokens; raise max_answer_tokens")
        text = part(message, "content")
        if text is not None and not isinstance(text, str):
            raise AnswerMalformed(f"expected a text as content, got {text!r:.120}")
        return Completion(
            text=text or "",
            tokens_in=count(reply, "usage", "prompt_tokens"),
            tokens_out=count(reply, "usage", "completion_tokens"),
        )

    def listing(self, settings: ServerSettings) -> tuple[WireRequest, ...]:
        """Ask for the list of models."""
        return (WireRequest(path="/models"),)

    def facts(self, settings: ServerSettings, replies: tuple[Json | None, ...]) -> ModelFacts:
        """Read the list; llama-server also says what a model takes."""
        reply = replies[0] or {}
        known = known_names(part(reply, "data"), "id")
        return ModelFacts(
            is_present=settings.model in known, known=known, has_vision=_vision(reply, settings)
        )


def _turn(message: ChatMessage) -> Json:
    if not message.images:
        return {"role": message.role, "content": message.text}
    images = [
        {"type": "image_url", "image_url": {"url": f"data:image/jpeg;base64,{base64_text(image)}"}}
        for image in message.images
    ]
    return {"role": message.role, "content": [*images, {"type": "text", "text": message.text}]}


def _response_format(chat: Chat, schema: Mapping[str, Any], mode: str) -> Json:
    reduced = wire_schema(schema)
    if mode == JSON_OBJECT:
        return {"type": "json_object", "schema": reduced}
    named = {"name": chat.schema_name, "schema": reduced, "strict": is_closed(reduced)}
    return {"type": "json_schema", "json_schema": named}


def _vision(reply: Json, settings: ServerSettings) -> bool | None:
    rows = reply.get("models")
    for row in rows if isinstance(rows, list) else ():
        if isinstance(row, dict) and settings.model in (row.get("name"), row.get("model")):
            listed = row.get("capabilities")
            return "multimodal" in listed if isinstance(listed, list) else None
    return None
