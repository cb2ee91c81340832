"""Answer questions, one JSON line each, on a Unix socket, without ever holding up the physics."""

import json
import socket
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sim_twin.errors import TwinError
from vla_deploy.client.peer_credentials import is_own_user

MAX_REQUEST_BYTES = 65_536

Answer = Callable[[Mapping[str, Any]], dict[str, Any]]


class JsonLineServer:
    """Serve any number of clients of the twin's own user, or of root, from the twin's own loop."""

    def __init__(self, path: Path, answer: Answer) -> None:
        self._answer = answer
        self._buffers: dict[socket.socket, bytearray] = {}
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.setblocking(False)
        self._path = path
        path.unlink(missing_ok=True)
        self._listener.bind(str(path))
        self._listener.listen()

    def filenos(self) -> list[int]:
        """Return the descriptors whose input matters."""
        return [self._listener.fileno(), *(client.fileno() for client in self._buffers)]

    def poll_once(self) -> None:
        """Accept clients and answer whole lines; never waits."""
        self._accept()
        for client in list(self._buffers):
            self._serve(client)

    def close(self) -> None:
        """Hang up and take the socket away."""
        for client in self._buffers:
            client.close()
        self._buffers.clear()
        self._listener.close()
        self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        try:
            client, _ = self._listener.accept()
        except BlockingIOError:
            return
        if not is_own_user(client):
            client.close()
            return
        client.setblocking(False)
        self._buffers[client] = bytearray()

    def _serve(self, client: socket.socket) -> None:
        buffer = self._buffers[client]
        try:
            data = client.recv(MAX_REQUEST_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        buffer += data
        if not data or len(buffer) > MAX_REQUEST_BYTES:
            self._drop(client)
            return
        while (end := buffer.find(b"\n")) >= 0:
            line = bytes(buffer[:end])
            del buffer[: end + 1]
            self._reply(client, line)

    def _reply(self, client: socket.socket, line: bytes) -> None:
        reply = json.dumps(self._judge(line)).encode() + b"\n"
        try:
            client.sendall(reply)
        except OSError:  # gone, or not reading: the next question gets a new connection
            self._drop(client)

    def _judge(self, line: bytes) -> dict[str, Any]:
        try:
            request = json.loads(line)
        except ValueError as error:
            return {"ok": False, "error": f"expected one JSON object a line: {error}"}
        if not isinstance(request, dict):
            return {"ok": False, "error": f"expected a JSON object, got {request!r}"}
        try:
            return {"ok": True, **self._answer(request)}
        except TwinError as error:
            return {"ok": False, "error": str(error)}

    def _drop(self, client: socket.socket) -> None:
        client.close()
        self._buffers.pop(client, None)
