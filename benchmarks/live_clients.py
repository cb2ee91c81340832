"""Be many WebSocket clients of a dashboard at little cost: bytes are taken, and counted only.

`python -m benchmarks.live_clients HOST PORT COUNT FROZEN TOPIC,... RUNTIME_BASE` prints "ready"
once all are subscribed, and what came as JSON when its input ends. The frozen ones read nothing.
"""

import json
import os
import selectors
import socket
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from vla_deploy.client.access.local_token import local_headers

PATH: Final = "/api/v1/live"
_KEY: Final = "dGhlIHNhbXBsZSBub25jZQ=="
_CHUNK_BYTES: Final = 1 << 16
_REST_S: Final = 0.05
_NICE: Final = 15
_END_S: Final = 1.0
_PATIENCE_S: Final = 30.0


def connected(
    host: str, port: int, headers: Mapping[str, str], *, is_frozen: bool
) -> socket.socket:
    """Return a WebSocket that is open; little fits between the server and a frozen one.

    Raises:
        ConnectionError: it was refused.
    """
    connection = socket.socket()
    connection.settimeout(_PATIENCE_S)
    if is_frozen:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect((host, port))
    upgrade = f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {_KEY}\r\n"
    version = "Sec-WebSocket-Version: 13\r\n"
    known = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    request = f"GET {PATH} HTTP/1.1\r\nHost: {host}:{port}\r\n{upgrade}{version}{known}\r\n"
    connection.sendall(request.encode())
    answer = b""
    while b"\r\n\r\n" not in answer:
        answer += connection.recv(1)
        if not answer:
            raise ConnectionError(f"{host}:{port}: no answer")
    if not answer.startswith(b"HTTP/1.1 101"):
        raise ConnectionError(f"{host}:{port}: {answer.splitlines()[0].decode()}")
    return connection


def subscribe(connection: socket.socket, topics: Sequence[str]) -> None:
    """Send one masked text; a mask of zeros leaves it as it is."""
    text = json.dumps({"subscribe": list(topics)}).encode()
    length = len(text).to_bytes(2, "big")
    connection.sendall(b"\x81" + bytes((0x80 | 126,)) + length + bytes(4) + text)


def main(argv: Sequence[str]) -> int:
    """Connect, take what comes until the input ends, and tell how much it was."""
    host, port, count, frozen, topics, base = argv
    os.nice(_NICE)
    headers = local_headers(Path(base))
    frozen_ones = [connected(host, int(port), headers, is_frozen=True) for _ in range(int(frozen))]
    others = int(count) - int(frozen)
    clients = [connected(host, int(port), headers, is_frozen=False) for _ in range(others)]
    selector = selectors.DefaultSelector()
    for client in (*frozen_ones, *clients):
        subscribe(client, topics.split(","))
    for client in clients:
        selector.register(client, selectors.EVENT_READ)
    selector.register(sys.stdin, selectors.EVENT_READ)
    print("ready", flush=True)
    taken = _take(selector)
    print(json.dumps(taken | {"frozen_cut_off": sum(map(_is_cut_off, frozen_ones))}), flush=True)
    return 0


def _is_cut_off(connection: socket.socket) -> bool:
    """Return whether what was on its way is followed by the connection's end."""
    connection.settimeout(_END_S)
    try:
        while connection.recv(_CHUNK_BYTES):
            pass
    except ConnectionError:
        return True
    except TimeoutError:
        return False
    return True


def _take(selector: selectors.BaseSelector) -> dict[str, float]:
    began_s, taken, ended = time.monotonic(), 0, 0
    while True:
        for key, _ in selector.select():
            if key.fileobj is sys.stdin:
                seconds = time.monotonic() - began_s
                return {"bytes_s": taken / seconds, "ended": ended}
            connection = key.fileobj
            assert isinstance(connection, socket.socket)
            got = len(connection.recv(_CHUNK_BYTES))
            taken += got
            if not got:
                ended += 1
                selector.unregister(connection)
        time.sleep(_REST_S)  # as a browser draws: not with every packet


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
