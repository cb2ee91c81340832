"""Send one request to one server and judge its one bounded reply: no redirects, no proxies."""

import json
import re
import ssl
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from email.utils import parsedate_to_datetime
from typing import Any, Final
from urllib.parse import urlsplit

from vla_deploy.model_servers.calls.privacy import Resolve, resolve
from vla_deploy.model_servers.errors import (
    AnswerMalformed,
    AnswerTooLarge,
    ServerFailed,
    ServerRefused,
)
from vla_deploy.model_servers.formats.base import Json, WireRequest
from vla_deploy.model_servers.json_answer import strict_json
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.one_line import one_line
from vla_deploy.runtime.secret import Secret

_BYTES_PER_KB: Final = 1024


_PASSING: Final = frozenset({408, 425, 429})
# Servers repeat a wrong key, or the half of it, in what they say about it.
_ABOUT_KEYS: Final = frozenset({401, 403})
# A rate limit passes; money that is spent does not come back by waiting.
_SPENT: Final = frozenset(
    {"insufficient_quota", "credit_balance_exhausted", "enforced_spend_limit_reached"}
)
_REASON_CHARACTERS: Final = 200
_SECONDS: Final = re.compile(r"\d{1,9}(\.\d{1,9})?")


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerReply:
    """Hold what a server sent; header names are in small letters."""

    status: int
    headers: Mapping[str, str]
    body: bytes


class Exchange:
    """Talk to one server over a fresh connection for each request.

    A connection costs little compared with a model's answer, and each can be checked anew.
    """

    def __init__(self, settings: ServerSettings, resolve: Resolve = resolve) -> None:
        self._settings = settings
        self._resolve = resolve
        self._tls: ssl.SSLContext | None = None

    def send(
        self, request: WireRequest, headers: Mapping[str, str], deadline: Deadline
    ) -> ServerReply:
        """Send a request and return the whole reply, whatever its status.

        Raises:
            PrivacyRefused: the server is not where it was declared to be.
            ServerUnreachable: there is no connection, or it broke.
            TimedOut: it takes too long.
            AnswerTooLarge: the reply is larger than allowed.
            AnswerMalformed: it is compressed.
            ServerRefused: the server's certificates cannot be checked.
        """
        import httpcore2  # 60 ms that most commands do without

        from vla_deploy.model_servers.calls.connection import GuardedBackend, client_errors

        settings = self._settings
        pool = httpcore2.ConnectionPool(
            ssl_context=self._tls_context(),
            network_backend=GuardedBackend(settings, deadline, self._resolve),
        )
        timeouts = {
            "connect": settings.connect_timeout_s,
            "read": settings.read_timeout_s,
            "write": settings.read_timeout_s,
        }
        content = None if request.body is None else json.dumps(request.body).encode("ascii")
        with (
            pool,
            client_errors(settings),
            pool.stream(
                "GET" if content is None else "POST",
                settings.url + request.path,
                headers=_headers(settings, content, headers),
                content=content,
                extensions={"timeout": timeouts},
            ) as response,
        ):
            return self._reply(response)

    def _reply(self, response: Any) -> ServerReply:
        headers = {
            name.decode("latin-1").lower(): value.decode("latin-1")
            for name, value in response.headers
        }
        packed = headers.get("content-encoding", "identity")
        if packed != "identity":
            raise AnswerMalformed(f"expected an answer that is not compressed, got {packed:.40}")
        limit = self._settings.max_answer_bytes
        body = bytearray()
        for chunk in response.iter_stream():
            body += chunk
            if len(body) > limit:
                raise AnswerTooLarge(
                    f"{self._settings.url}: expected at most {limit / _BYTES_PER_KB:.0f} KB, "
                    "got more; raise max_answer_bytes if that is right"
                )
        return ServerReply(status=response.status, headers=headers, body=bytes(body))

    def _tls_context(self) -> ssl.SSLContext | None:
        if not self._settings.url.startswith("https://"):
            return None
        if self._tls is None:
            self._tls = _open_tls(self._settings)
        return self._tls


def _open_tls(settings: ServerSettings) -> ssl.SSLContext:
    import httpcore2

    if settings.ca_file is None:
        return httpcore2.default_ssl_context()
    try:
        return ssl.create_default_context(cafile=settings.ca_file)
    except OSError as error:  # SSLError is one
        raise ServerRefused(f"ca_file: {settings.ca_file}: {error}") from error


def _headers(
    settings: ServerSettings, content: bytes | None, others: Mapping[str, str]
) -> list[tuple[str, str]]:
    plain = {
        # The client would leave out the brackets of an IPv6 address.
        "Host": urlsplit(settings.url).netloc,
        "Accept": "application/json",
        "Accept-Encoding": "identity",
        "Connection": "close",
    }
    kind = {} if content is None else {"Content-Type": "application/json"}
    return [*plain.items(), *kind.items(), *others.items()]


def document_of(reply: ServerReply, settings: ServerSettings, key: Secret | None) -> Json:
    """Return the JSON object that a server answers with.

    Raises:
        ServerRefused: it will not answer this request, or points elsewhere.
        ServerFailed: it cannot answer now.
        AnswerMalformed: what it sends is no JSON object.
    """
    if 200 <= reply.status < 300:
        return _object(reply)
    if 300 <= reply.status < 400:
        raise ServerRefused(_elsewhere(reply, settings), reply.status)
    said = _said(reply, key)
    message = f"{settings.url}: HTTP {reply.status}{said}"
    spent = not _SPENT.isdisjoint(_codes(_error(reply)))
    if reply.status >= 500 or (reply.status in _PASSING and not spent):
        raise ServerFailed(message, reply.status, retry_after_s(reply))
    raise ServerRefused(message + _remedy(reply.status, settings), reply.status)


def retry_after_s(reply: ServerReply) -> float | None:
    """Return how long the server asks to be left alone; a date counts from the reply's own."""
    text = reply.headers.get("retry-after", "").strip()
    if _SECONDS.fullmatch(text):
        return float(text)
    until, now = _date(text), _date(reply.headers.get("date", ""))
    if until is None or now is None:
        return None
    return max(0.0, (until - now).total_seconds())


def _object(reply: ServerReply) -> Json:
    try:
        found = strict_json(reply.body.decode("utf-8"))
    except ValueError as error:
        raise AnswerMalformed(f"expected JSON from the server: {error!s:.120}") from error
    if not isinstance(found, dict):
        raise AnswerMalformed(f"expected a JSON object from the server, got {found!r:.60}")
    return found


def _elsewhere(reply: ServerReply, settings: ServerSettings) -> str:
    parts = urlsplit(reply.headers.get("location", ""))
    target = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}" if parts.netloc else "elsewhere"
    return (
        f"{settings.url}: HTTP {reply.status} points to {target:.120}; that is not followed. "
        "If it is right, declare that url"
    )


def _said(reply: ServerReply, key: Secret | None) -> str:
    if reply.status in _ABOUT_KEYS:
        return ""
    error = _error(reply)
    text = error.get("message", error.get("error", error.get("detail", "")))
    said = one_line(text) if key is None else key.hidden_in(one_line(text))
    return f": {said[:_REASON_CHARACTERS]}" if said else ""


def _error(reply: ServerReply) -> dict[str, Any]:
    """Return the object that describes an error, empty where there is none."""
    try:
        document = _object(reply)
    except AnswerMalformed:
        return {}
    inner = document.get("error")
    return inner if isinstance(inner, dict) else document


def _codes(error: dict[str, Any]) -> Iterator[str]:
    details = error.get("details")
    for table in (error, details if isinstance(details, dict) else {}):
        yield from (str(table[name]) for name in ("type", "code", "error_code") if name in table)


def _remedy(status: int, settings: ServerSettings) -> str:
    if status in _ABOUT_KEYS:
        named = f"credential {settings.credential}" if settings.credential else "no credential"
        return f": it refuses the key ({named})"
    return f"; look at url and model ({settings.model})" if status == 404 else ""


def _date(text: str) -> datetime | None:
    try:
        return parsedate_to_datetime(text)
    except ValueError:
        return None
