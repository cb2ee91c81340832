"""Ask another process one question over a Unix socket: a line of JSON each way."""

import json
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

TIMEOUT_S: Final = 10.0
_CHUNK_BYTES: Final = 65_536


def request(path: Path, question: Mapping[str, Any]) -> dict[str, Any]:
    """Return the answer of the server at `path`.

    Raises:
        OSError: nobody listens there, or no whole answer comes within 10 s of silence.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.settimeout(TIMEOUT_S)
        client.connect(str(path))
        client.sendall(json.dumps(question).encode() + b"\n")
        reply = bytearray()
        while not reply.endswith(b"\n"):
            data = client.recv(_CHUNK_BYTES)
            if not data:
                raise ConnectionError("the other end hung up")
            reply += data
    answer: dict[str, Any] = json.loads(reply)
    return answer
