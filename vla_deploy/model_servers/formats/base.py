"""Define what a server's language must be able to do; nothing here touches a network."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

from vla_deploy.model_servers.chat import Chat, Completion
from vla_deploy.model_servers.errors import AnswerMalformed
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.secret import Secret

_KEPT: Final = frozenset({"type", "enum", "const", "description", "$ref", "required"})
_LISTS: Final = ("anyOf",)
_NAMED: Final = ("properties", "$defs")
Json = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class WireRequest:
    """Hold one HTTP request; without a `body` it is a GET. `path` follows the server's URL."""

    path: str
    body: Json | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """Hold what a server says of its models; `has_vision` is None where it does not say."""

    is_present: bool
    known: tuple[str, ...]
    has_vision: bool | None = None


class Format(Protocol):
    """Turn questions into requests, and replies into answers.

    `schema_modes` names the ways to ask for JSON of a schema, the strictest first; the last one
    only asks in words, which every server understands.
    """

    schema_modes: tuple[str, ...]

    def headers(self, key: Secret | None) -> dict[str, str]:
        """Return the headers that every request carries."""
        ...

    def request(self, settings: ServerSettings, chat: Chat, mode: str) -> WireRequest:
        """Return the request for a question."""
        ...

    def completion(self, reply: Json) -> Completion:
        """Read a reply.

        Raises:
            AnswerMalformed: it is not of this language.
            AnswerRefused: the model declines.
            AnswerTruncated: it ran out of tokens.
        """
        ...

    def listing(self, settings: ServerSettings) -> tuple[WireRequest, ...]:
        """Return the requests for facts about models; `facts` reads the replies."""
        ...

    def facts(self, settings: ServerSettings, replies: tuple[Json | None, ...]) -> ModelFacts:
        """Read the replies to `listing`; None stands for one that was refused.

        Raises:
            AnswerMalformed: they are not of this language.
        """
        ...


def bearer(key: Secret | None) -> dict[str, str]:
    """Return a key's header, none where the server wants no key."""
    return {} if key is None else {"Authorization": f"Bearer {key.reveal()}"}


def base64_text(image: bytes) -> str:
    """Return a file as a JSON body carries it."""
    return base64.b64encode(image).decode("ascii")


def part(reply: Any, *path: str | int) -> Any:
    """Return a part of a reply by keys and indices.

    Raises:
        AnswerMalformed: there is none.
    """
    found = reply
    for step in path:
        try:
            found = found[step]
        except (KeyError, IndexError, TypeError):
            where = ".".join(map(str, path))
            raise AnswerMalformed(f"expected {where} in the reply, got {reply!r:.120}") from None
    return found


def count(reply: Json, group: str, name: str) -> int | None:
    """Return a count of tokens, or None where the server gives none."""
    usage = reply.get(group) if group else reply
    found = usage.get(name) if isinstance(usage, dict) else None
    return found if isinstance(found, int) and not isinstance(found, bool) else None


def known_names(rows: Any, key: str) -> tuple[str, ...]:
    """Return the names in a list of models.

    Raises:
        AnswerMalformed: it is no list of objects.
    """
    if not isinstance(rows, list):
        raise AnswerMalformed(f"expected a list of models in the reply, got {rows!r:.120}")
    return tuple(str(row[key]) for row in rows if isinstance(row, dict) and key in row)


def wire_schema(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema whose objects are closed and have all their properties."""
    reduced = {key: value for key, value in schema.items() if key in _KEPT}
    for key in _NAMED:
        if key in schema:
            reduced[key] = {name: wire_schema(inner) for name, inner in schema[key].items()}
    for key in _LISTS:
        if key in schema:
            reduced[key] = [wire_schema(inner) for inner in schema[key]]
    items = schema.get("items")
    if isinstance(items, Mapping):
        reduced["items"] = wire_schema(items)
    if "properties" in schema:
        reduced["required"] = list(schema["properties"])
        reduced["additionalProperties"] = False
    return reduced


def is_closed(schema: Mapping[str, Any]) -> bool:
    """Return whether every object of a reduced schema names its properties, for strict modes."""
    if schema.get("type") == "object" and "properties" not in schema:
        return False
    inner = [one for key in _NAMED for one in schema.get(key, {}).values()]
    inner += [one for key in _LISTS for one in schema.get(key, ())]
    inner += [schema["items"]] if "items" in schema else []
    return all(map(is_closed, inner))
