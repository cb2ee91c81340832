"""Speak Anthropic's Messages API."""

import json
from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import quote

from vla_deploy.model_servers.chat import Chat, ChatMessage, Completion
from vla_deploy.model_servers.errors import AnswerMalformed, AnswerRefused, AnswerTruncated
from vla_deploy.model_servers.formats.base import (
    Json,
    ModelFacts,
    WireRequest,
    base64_text,
    count,
    is_closed,
    part,
    wire_schema,
)
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.secret import Secret

OUTPUT_FORMAT: Final = "output_format"
# Models that know no output format fill in the arguments of a tool that they must use.
TOOL: Final = "tool"
WORDS: Final = "words"
VERSION: Final = "2023-06-01"


class AnthropicMessages:
    """Speak the language of `/v1/messages`; the server's URL is without `/v1`."""

    schema_modes: tuple[str, ...] = (OUTPUT_FORMAT, TOOL, WORDS)

    def headers(self, key: Secret | None) -> dict[str, str]:
        """Return the version's header and the key's."""
        versioned = {"anthropic-version": VERSION}
        return versioned if key is None else {**versioned, "x-api-key": key.reveal()}

    def request(self, settings: ServerSettings, chat: Chat, mode: str) -> WireRequest:
        """Return the request for a question."""
        body: Json = {
            "model": settings.model,
            "max_tokens": settings.max_answer_tokens,
            "messages": list(map(_turn, chat.messages)),
        }
        if chat.system:
            body["system"] = chat.system
        if settings.temperature is not None:
            body["temperature"] = settings.temperature
        if chat.schema is not None:
            body |= _constraint(chat, chat.schema, mode)
        return WireRequest(path="/v1/messages", body=body)

    def completion(self, reply: Json) -> Completion:
        """Read a reply: its text, or the arguments of the tool that stands for it."""
        ended = part(reply, "stop_reason")
        if ended == "refusal":
            details = reply.get("stop_details")
            why = details.get("explanation") if isinstance(details, dict) else None
            raise AnswerRefused(f"the model declines: {why or 'no reason given'!s:.200}")
        if ended in ("max_tokens", "model_context_window_exceeded"):
            raise AnswerTruncated("the model ran out of tokens; raise max_answer_tokens")
        blocks = part(reply, "content")
        if not isinstance(blocks, list) or not all(isinstance(one, dict) for one in blocks):
            raise AnswerMalformed(f"expected a list of blocks as content, got {blocks!r:.120}")
        texts = [str(one.get("text", "")) for one in blocks if one.get("type") == "text"]
        tools = [json.dumps(one.get("input")) for one in blocks if one.get("type") == "tool_use"]
        return Completion(
            text="\n".join(tools or texts),
            tokens_in=count(reply, "usage", "input_tokens"),
            tokens_out=count(reply, "usage", "output_tokens"),
        )

    def listing(self, settings: ServerSettings) -> tuple[WireRequest, ...]:
        """Ask for the one model: a list would come in pages."""
        return (WireRequest(path=f"/v1/models/{quote(settings.model, safe='')}"),)

    def facts(self, settings: ServerSettings, replies: tuple[Json | None, ...]) -> ModelFacts:
        """Read the description; an alias is answered with the model's full name."""
        reply = replies[0]
        if reply is None:
            return ModelFacts(is_present=False, known=())
        return ModelFacts(is_present=True, known=(str(part(reply, "id")),))


def _turn(message: ChatMessage) -> Json:
    images = [
        {
            "type": "image",
            "source": {
                "type": "base64",
                "media_type": "image/jpeg",
                "data": base64_text(image),
            },
        }
        for image in message.images
    ]
    return {"role": message.role, "content": [*images, {"type": "text", "text": message.text}]}


def _constraint(chat: Chat, schema: Mapping[str, Any], mode: str) -> Json:
    reduced = wire_schema(schema)
    if mode == OUTPUT_FORMAT and is_closed(reduced):
        return {"output_config": {"format": {"type": "json_schema", "schema": reduced}}}
    if mode == WORDS:
        return {}
    tool = {
        "name": chat.schema_name,
        "description": "Give the answer.",
        "input_schema": reduced,
    }
    return {"tools": [tool], "tool_choice": {"type": "tool", "name": chat.schema_name}}
