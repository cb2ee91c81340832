"""Reach one device over HTTP, as Shelly and Tasmota plugs are: one request switches, one reads.

Redirects are not followed, an answer has a bound in size and time, and messages show a URL without
its query: there may be a key in it.
"""

import base64
import contextlib
import http.client
import socket
import threading
from collections.abc import Callable, Mapping
from typing import Final
from urllib.parse import SplitResult, urlsplit

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.devices.errors import DeviceAway, DeviceNotUsable, StateUnreadable
from vla_deploy.devices.login import DeviceLogin
from vla_deploy.devices.state_text import MOST_BYTES, StateWords, shown
from vla_deploy.devices.transport import DeviceReading
from vla_deploy.robots.home_devices import HttpRequests

REQUEST_S: Final = 3.0
"""How long one request may take, from the call to the last byte."""
STATE_S: Final = 3.0
_AGAIN_S: Final = 0.2
_REFUSED: Final = frozenset({401, 403})
_REDIRECTS: Final = range(300, 400)


class HttpLink:
    """Switch a device by a request, and ask for its state until that is as it should be."""

    called = ""
    look_period_s = 10.0

    def __init__(
        self, declared: HttpRequests, read_login: Callable[[], DeviceLogin] | None = None
    ) -> None:
        """Prepare; nothing is sent yet. `read_login` returns user and password, where needed."""
        self.where = _shown(urlsplit(declared.state))
        self._declared = declared
        self._words = StateWords(
            on=declared.state_on, off=declared.state_off, pointer=declared.pointer
        )
        self._read_login = read_login
        self._clock = MonotonicClock()
        self._ended = threading.Event()

    def switch(self, on: bool) -> DeviceReading:
        """Send the command, and return the state that the device tells within 3 s of it.

        Raises:
            DeviceError: the device is away, refuses, or tells no state that can be read.
        """
        declared = self._declared
        self._request(declared.method, declared.on if on else declared.off)
        end_ns = self._clock.now_ns() + round(STATE_S * NS_PER_S)
        while True:
            reading = self.read()
            if reading.is_on is on or self._clock.now_ns() >= end_ns:
                return reading
            if self._ended.wait(_AGAIN_S):
                return reading

    def read(self) -> DeviceReading:
        """Ask for the state.

        Raises:
            DeviceError: the device is away, refuses, or tells no state that can be read.
        """
        answer = self._request("GET", self._declared.state)
        try:
            return DeviceReading(is_on=self._words.is_on(answer))
        except StateUnreadable as error:
            raise StateUnreadable(f"{self.where}: {error}") from error

    def interrupt(self) -> None:
        """Ask no more."""
        self._ended.set()

    def close(self) -> None:
        """Do nothing: each request has a connection of its own."""

    def _request(self, method: str, url: str) -> bytes:
        parts = urlsplit(url)
        connection = _connection(parts)
        target = f"{parts.path or '/'}{'?' if parts.query else ''}{parts.query}"
        try:
            with _Deadline(connection, self._ended) as deadline:
                connection.request(method, target, headers=self._headers())
                with connection.getresponse() as answer:
                    body, missing = _body(answer, parts), answer.length
        except (OSError, http.client.HTTPException, ValueError) as error:
            why = getattr(error, "strerror", None) or shown(error) or type(error).__name__
            raise DeviceAway(f"{_shown(parts)}: no answer: {why}") from error
        if deadline.has_passed or missing:
            raise DeviceAway(f"{_shown(parts)}: no whole answer within {REQUEST_S:g} s")
        _expect_success(answer.status, parts)
        return body

    def _headers(self) -> Mapping[str, str]:
        headers = {"Accept": "application/json, text/plain", "Connection": "close"}
        if self._read_login is None:
            return headers
        login = self._read_login()
        pair = f"{login.user}:{login.password.reveal()}".encode()
        return {**headers, "Authorization": f"Basic {base64.b64encode(pair).decode('ascii')}"}


class _Deadline:
    """Cut a connection when the time for a request is over, whatever trickles in meanwhile."""

    def __init__(self, connection: http.client.HTTPConnection, ended: threading.Event) -> None:
        self._connection = connection
        self._ended = ended
        self._timer = threading.Timer(REQUEST_S, self._cut)
        self.has_passed = False

    def __enter__(self) -> "_Deadline":
        if self._ended.is_set():
            raise ConnectionAbortedError("the robot ends")
        self._connection.connect()
        self._socket: socket.socket = self._connection.sock
        self._timer.daemon = True
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        self._connection.close()

    def _cut(self) -> None:
        self.has_passed = True
        with contextlib.suppress(OSError):  # it has ended by itself
            self._socket.shutdown(socket.SHUT_RDWR)


def _body(answer: http.client.HTTPResponse, parts: SplitResult) -> bytes:
    body = answer.read(MOST_BYTES + 1)
    if len(body) > MOST_BYTES:
        raise StateUnreadable(f"{_shown(parts)}: the answer has over {MOST_BYTES} bytes")
    return body


def _connection(parts: SplitResult) -> http.client.HTTPConnection:
    kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    return kind(str(parts.hostname), parts.port, timeout=REQUEST_S)


def _expect_success(status: int, parts: SplitResult) -> None:
    if 200 <= status < 300:
        return
    if status in _REFUSED:
        raise DeviceNotUsable(
            f"{_shown(parts)}: it refuses us (HTTP {status}); see credentials in the robot file"
        )
    if status in _REDIRECTS:
        raise DeviceNotUsable(
            f"{_shown(parts)}: it sends us elsewhere (HTTP {status}), which is not followed; "
            "correct the URL in the robot file"
        )
    raise DeviceAway(f"{_shown(parts)}: HTTP {status}")


def _shown(parts: SplitResult) -> str:
    """Return a URL without its query."""
    return f"{parts.scheme}://{parts.netloc}{parts.path}"
