"""Send one request to one server, and take one bounded reply: no redirects, no proxies."""

import json
import ssl
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import urlsplit

from vla_deploy.model_servers.calls.addresses import Resolve, resolve
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.model_servers.errors import (
    AnswerMalformed,
    AnswerTooLarge,
    ServerRefused,
)
from vla_deploy.model_servers.formats.base import WireRequest
from vla_deploy.model_servers.settings import ServerSettings

_BYTES_PER_KB: Final = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerReply:
    """Hold what a server sent; header names are in small letters."""

    status: int
    headers: Mapping[str, str]
    body: bytes


class Exchange:
    """Talk to one server over a fresh connection for each request.

    What a connection costs is little beside a model's answer, and each can be checked anew.
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
                headers=_headers(settings, content, {**request.headers, **headers}),
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
