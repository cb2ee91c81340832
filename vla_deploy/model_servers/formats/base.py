"""Say what a server's language must be able to do; nothing here touches a network."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from vla_deploy.model_servers.chat import Chat, Completion
from vla_deploy.model_servers.credentials import Secret
from vla_deploy.model_servers.errors import AnswerMalformed
from vla_deploy.model_servers.settings import ServerSettings

Json = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class WireRequest:
    """Hold one HTTP request; without a `body` it is a GET. `path` follows the server's URL."""

    path: str
    body: Json | None = None
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """Hold what a server tells of its models; `has_vision` is None where it does not say."""

    is_present: bool
    known: tuple[str, ...]
    has_vision: bool | None = None


class Format(Protocol):
    """Turn questions into requests, and replies into answers.

    `rungs` names the ways to ask for JSON of a schema, the strictest first; the last one merely
    asks in words, which every server understands.
    """

    rungs: tuple[str, ...]

    def headers(self, key: Secret | None) -> dict[str, str]:
        """Return the headers that every request carries."""
        ...

    def request(self, settings: ServerSettings, chat: Chat, rung: str) -> WireRequest:
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
        """Return the requests that tell about models; `facts` reads the replies."""
        ...

    def facts(self, settings: ServerSettings, replies: tuple[Json | None, ...]) -> ModelFacts:
        """Read the replies to `listing`; None stands for one that was refused.

        Raises:
            AnswerMalformed: they are not of this language.
        """
        ...


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
    """Return a count of tokens, or None where the server tells none."""
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
