"""Connect to addresses that were checked, and bound each wait by the call's deadline.

The one module that imports the HTTP client, which takes a moment; import it late.
"""

import contextlib
import ssl
from collections.abc import Iterable, Iterator
from typing import Any, Final

import httpcore2

from vla_deploy.model_servers.calls.limits import bounded_s
from vla_deploy.model_servers.calls.privacy import Resolve, check_address
from vla_deploy.model_servers.errors import ServerUnreachable, TimedOut
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.deadline import Deadline

# The client sends a buffer in a loop with one time-out for each turn: small buffers, few turns.
_CHUNK_BYTES: Final = 16_384
# How often a wait for the answer looks whether anybody still wants it.
_LOOK_S: Final = 0.2


class GuardedBackend(httpcore2.NetworkBackend):
    """Connect to one declared server only, where it really is."""

    def __init__(self, settings: ServerSettings, deadline: Deadline, resolve: Resolve) -> None:
        self._settings = settings
        self._deadline = deadline
        self._resolve = resolve
        self._inner = httpcore2.SyncBackend()

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[Any] | None = None,
    ) -> httpcore2.NetworkStream:
        """Connect to the first address that answers.

        Raises:
            PrivacyRefused: one of the addresses is none that the server may have.
            ServerUnreachable: none of them answers.
            TimedOut: no time is left.
        """
        addresses = self._resolve(host, port, bounded_s(self._deadline, timeout))
        for address in addresses:
            check_address(self._settings, address)
        reasons = []
        for address in addresses:
            try:
                stream = self._inner.connect_tcp(
                    address, port, bounded_s(self._deadline, timeout), local_address, ()
                )
            except (httpcore2.ConnectError, httpcore2.ConnectTimeout) as error:
                reasons.append(f"{address}: {error}")
                continue
            return self._checked(stream)
        raise ServerUnreachable(
            f"no connection to {host}:{port}: {'; '.join(reasons)}", was_sent=False
        )

    def _checked(self, stream: httpcore2.NetworkStream) -> httpcore2.NetworkStream:
        """Ask the socket itself whom it has reached."""
        try:
            check_address(self._settings, stream.get_extra_info("server_addr")[0])
        except Exception:
            stream.close()
            raise
        return _DeadlineStream(stream, self._deadline)


class _DeadlineStream(httpcore2.NetworkStream):
    """Give every read and write no more time than the call has left."""

    def __init__(self, stream: httpcore2.NetworkStream, deadline: Deadline) -> None:
        self._stream = stream
        self._deadline = deadline

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        silence_s = bounded_s(self._deadline, timeout)
        if self._deadline.recall is None:
            return self._stream.read(max_bytes, silence_s)
        silence = Deadline.within(self._deadline.clock, silence_s)
        while True:
            try:
                return self._stream.read(max_bytes, bounded_s(self._deadline, _LOOK_S))
            except httpcore2.ReadTimeout:
                if silence.left_s <= 0.0:
                    raise

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        for start in range(0, len(buffer), _CHUNK_BYTES):
            chunk = buffer[start : start + _CHUNK_BYTES]
            self._stream.write(chunk, bounded_s(self._deadline, timeout))

    def close(self) -> None:
        self._stream.close()

    def start_tls(
        self,
        ssl_context: ssl.SSLContext,
        server_hostname: str | None = None,
        timeout: float | None = None,
    ) -> httpcore2.NetworkStream:
        bound_s = bounded_s(self._deadline, timeout)
        secured = self._stream.start_tls(ssl_context, server_hostname, bound_s)
        return _DeadlineStream(secured, self._deadline)

    def get_extra_info(self, info: str) -> Any:
        return self._stream.get_extra_info(info)


@contextlib.contextmanager
def client_errors(settings: ServerSettings) -> Iterator[None]:
    """Turn the HTTP client's errors into ours."""
    where = settings.url
    try:
        yield
    except httpcore2.ConnectTimeout as error:
        limit_s = settings.connect_timeout_s
        raise TimedOut(f"{where}: no connection within {limit_s:g} s") from error
    except httpcore2.TimeoutException as error:
        limit_s = settings.read_timeout_s
        raise TimedOut(f"{where}: silent for {limit_s:g} s, or no time left") from error
    except httpcore2.ConnectError as error:
        raise ServerUnreachable(f"{where}: no connection: {error}", was_sent=False) from error
    except httpcore2.NetworkError as error:
        raise ServerUnreachable(f"{where}: the connection broke: {error}", was_sent=True) from error
    except httpcore2.ProtocolError as error:
        raise ServerUnreachable(f"{where}: no whole HTTP answer: {error}", was_sent=True) from error
