"""Speak Ollama's own `/api/chat`, whose `format` takes a schema."""

from typing import Final

from vla_deploy.model_servers.chat import Chat, ChatMessage, Completion
from vla_deploy.model_servers.errors import AnswerMalformed, AnswerTruncated
from vla_deploy.model_servers.formats.base import (
    Json,
    ModelFacts,
    WireRequest,
    base64_text,
    bearer,
    count,
    known_names,
    part,
    wire_schema,
)
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.secret import Secret

SCHEMA: Final = "schema"
ANY_JSON: Final = "json"
WORDS: Final = "words"


class OllamaChat:
    """Speak the language of `/api/chat`."""

    schema_modes: tuple[str, ...] = (SCHEMA, ANY_JSON, WORDS)

    def headers(self, key: Secret | None) -> dict[str, str]:
        """Return the key's header, for servers behind a proxy that wants one."""
        return bearer(key)

    def request(self, settings: ServerSettings, chat: Chat, mode: str) -> WireRequest:
        """Return the request for a question."""
        system = [{"role": "system", "content": chat.system}] if chat.system else []
        options: Json = {"num_predict": settings.max_answer_tokens}
        if settings.temperature is not None:
            options["temperature"] = settings.temperature
        body: Json = {
            "model": settings.model,
            "messages": [*system, *map(_turn, chat.messages)],
            "stream": False,
            "options": options,
        }
        if chat.schema is not None and mode != WORDS:
            body["format"] = wire_schema(chat.schema) if mode == SCHEMA else "json"
        return WireRequest(path="/api/chat", body=body)

    def completion(self, reply: Json) -> Completion:
        """Read a reply."""
        text = part(reply, "message", "content")
        if not isinstance(text, str):
            raise AnswerMalformed(f"expected a text as message.content, got {text!r:.120}")
        if reply.get("done_reason") == "length":
            raise AnswerTruncated("the model ran out of tokens; raise max_answer_tokens")
        if reply.get("done") is not True:
            raise AnswerTruncated("the reply ends before the model had done")
        return Completion(
            text=text,
            tokens_in=count(reply, "", "prompt_eval_count"),
            tokens_out=count(reply, "", "eval_count"),
        )

    def listing(self, settings: ServerSettings) -> tuple[WireRequest, ...]:
        """Ask for the list of models, and what ours can do."""
        show = WireRequest(path="/api/show", body={"model": settings.model})
        return (WireRequest(path="/api/tags"), show)

    def facts(self, settings: ServerSettings, replies: tuple[Json | None, ...]) -> ModelFacts:
        """Read the list and the description; a name without a tag means `latest`."""
        known = known_names(part(replies[0] or {}, "models"), "name")
        wanted = settings.model if ":" in settings.model else f"{settings.model}:latest"
        listed = replies[1].get("capabilities") if replies[1] else None
        return ModelFacts(
            is_present=wanted in known,
            known=known,
            has_vision="vision" in listed if isinstance(listed, list) else None,
        )


def _turn(message: ChatMessage) -> Json:
    turn: Json = {"role": message.role, "content": message.text}
    if message.images:
        turn["images"] = [base64_text(image) for image in message.images]
    return turn
