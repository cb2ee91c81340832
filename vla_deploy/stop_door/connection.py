"""Serve one client: read a head, write the answer, let it be read; never wait for the client."""

import re
import selectors
import socket
import ssl
from collections.abc import Callable
from enum import Enum
from typing import Final

from drivers.clock import NS_PER_S

MAX_HEAD_BYTES: Final = 16_384
"""Room for the cookies that a browser sends along for every other port of the same host."""
READ_NS: Final = 2 * NS_PER_S
WRITE_NS: Final = 2 * NS_PER_S
LINGER_NS: Final = NS_PER_S
_HEAD_END: Final = re.compile(rb"\r?\n\r?\n")  # as a person types it, too
_LINE_END: Final = b"\n"
_CHUNK_BYTES: Final = 16_384
"""As much as a TLS record holds, so that none is left over where no selector sees it."""
_ACTS_AT_ONCE: Final = 8
"""Then the others are served, however fast a client sends."""


class Stage(Enum):
    """Name how far a connection is."""

    READING = "reading"
    ANSWERING = "answering"
    LINGERING = "lingering"
    CLOSED = "closed"


Answer = Callable[[bytes, bool], bytes]
"""Makes the answer from a head, and from whether it is whole."""


class Connection:
    """Carry one request and its answer.

    `interest` is what the selector shall wait for. The body of a request is never needed: it is
    read and forgotten while the client reads the answer, which closing at once would destroy.
    """

    def __init__(self, client: socket.socket, peer: str, answer: Answer, now_ns: int) -> None:
        self.peer = peer
        self.socket = client
        self.stage = Stage.READING
        self.interest = selectors.EVENT_READ
        self.deadline_ns = now_ns + READ_NS
        self._answer = answer
        self._head = bytearray()
        self._unsent = memoryview(b"")

    def proceed(self, now_ns: int) -> None:
        """Do what can be done without waiting; a client that has gone closes the connection."""
        try:
            for _ in range(_ACTS_AT_ONCE):
                if self.stage is Stage.CLOSED:
                    return
                self._act(now_ns)
            self.interest = self._wanted()
        except ssl.SSLWantWriteError:
            self.interest = selectors.EVENT_WRITE
        except ssl.SSLWantReadError:
            self.interest = selectors.EVENT_READ
        except BlockingIOError:
            self.interest = self._wanted()
        except OSError:  # reset, or no TLS: nobody is there to be answered
            self.close()

    def expire(self, now_ns: int) -> None:
        """Answer a press whose head never became whole; close everything else."""
        if self.stage is Stage.READING and _LINE_END in self._head:
            self._conclude(now_ns, whole=False)
            self.proceed(now_ns)
        else:
            self.close()

    def close(self) -> None:
        """Close the connection; closing twice is allowed."""
        self.stage = Stage.CLOSED
        self.socket.close()

    def _wanted(self) -> int:
        answering = self.stage is Stage.ANSWERING
        return selectors.EVENT_WRITE if answering else selectors.EVENT_READ

    def _act(self, now_ns: int) -> None:
        if self.stage is Stage.READING:
            self._read(now_ns)
        elif self.stage is Stage.ANSWERING:
            self._write(now_ns)
        elif not self.socket.recv(_CHUNK_BYTES):
            self.close()

    def _read(self, now_ns: int) -> None:
        received = self.socket.recv(_CHUNK_BYTES)
        self._head += received
        if _HEAD_END.search(self._head):
            self._conclude(now_ns, whole=True)
        elif len(self._head) > MAX_HEAD_BYTES:
            self._conclude(now_ns, whole=False)
        elif not received:
            self.expire(now_ns)

    def _conclude(self, now_ns: int, *, whole: bool) -> None:
        head = _HEAD_END.split(self._head, 1)[0]
        self._head.clear()
        self._unsent = memoryview(self._answer(head, whole))
        self.stage, self.deadline_ns = Stage.ANSWERING, now_ns + WRITE_NS

    def _write(self, now_ns: int) -> None:
        self._unsent = self._unsent[self.socket.send(self._unsent) :]
        if not self._unsent:
            self.socket.shutdown(socket.SHUT_WR)
            self.stage, self.deadline_ns = Stage.LINGERING, now_ns + LINGER_NS
