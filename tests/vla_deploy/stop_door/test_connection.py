"""Hold that one client's bytes, however fast they come, leave the door to the others."""

import socket
from typing import Any

import pytest

from vla_deploy.stop_door.connection import LINGER_NS, Connection, Stage

MOST_READS = 100


class Torrent(socket.socket):
    """Be the wire to a client that sends without end, and faster than anybody reads."""

    def __init__(self, head: bytes) -> None:
        super().__init__()
        self._head = head
        self._reads = 0

    def recv(self, most: int, *_: Any) -> bytes:
        self._reads += 1
        assert self._reads < MOST_READS, "it reads on and serves nobody else"
        head, self._head = self._head[:most], self._head[most:]
        return head or b"x" * most

    def send(self, data: Any, *_: Any) -> int:
        return len(data)

    def shutdown(self, how: int) -> None:
        return None


@pytest.mark.parametrize("head", [b"GET / HTTP/1.1\r\n\r\n", b"", b"POST /stop HTTP/1.1\r\n"])
def test_who_sends_without_end_gets_a_turn_like_everybody_else(head):
    answered: list[bytes] = []

    def answer(head: bytes, whole: bool) -> bytes:
        answered.append(head)
        return b"HTTP/1.1 200 OK\r\n\r\n"

    connection = Connection(Torrent(head), "192.168.1.9", answer, 0)
    for _ in range(3):
        connection.proceed(0)
    assert (connection.stage, len(answered)) == (Stage.LINGERING, 1)
    assert connection.deadline_ns <= LINGER_NS
    connection.expire(LINGER_NS)
    assert connection.stage is Stage.CLOSED
