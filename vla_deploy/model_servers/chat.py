"""Hold what is asked of a model, and what it answers, in the form common to all servers."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class ChatRole(StrEnum):
    """Say who speaks in a conversation."""

    USER = "user"
    ASSISTANT = "assistant"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChatMessage:
    """Hold one turn; `images` are JPEG files, of the user's turns only."""

    text: str
    role: ChatRole = ChatRole.USER
    images: tuple[bytes, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Chat:
    """Hold one question to a model: standing instructions, and turns of which the last asks.

    `schema` is the JSON Schema that the answer should have, `schema_name` what to call it.
    """

    messages: tuple[ChatMessage, ...]
    system: str = ""
    schema: Mapping[str, Any] | None = None
    schema_name: str = "answer"

    @property
    def has_images(self) -> bool:
        """Return whether any turn carries an image."""
        return any(message.images for message in self.messages)


@dataclass(frozen=True, slots=True, kw_only=True)
class Completion:
    """Hold a model's answer; counts of tokens are None where the server gives none."""

    text: str
    tokens_in: int | None
    tokens_out: int | None
