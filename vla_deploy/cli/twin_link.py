"""Speak JSON lines to the twin of a run, where the run has one."""

import json
import socket
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.errors import CommandFailed, UsageError

_SOCKET: Final = Path("dev") / "referee"
_TIMEOUT_S: Final = 10.0
_CHUNK_BYTES: Final = 65_536


def ask_twin(run_dir: Path, op: str, **details: Any) -> dict[str, Any]:
    """Return the twin's answer.

    Raises:
        UsageError: the run has no twin, or the twin refuses.
        CommandFailed: the twin is there and does not answer.
    """
    path = run_dir / _SOCKET
    if not path.is_socket():
        raise UsageError(
            f"this run has no twin ({path} is not there): faults are for the twin alone; "
            "start one: vla-deploy run --twin"
        )
    request = json.dumps({"op": op, **details}).encode() + b"\n"
    try:
        answer: dict[str, Any] = json.loads(_exchange(path, request))
    except OSError as error:
        raise CommandFailed(f"{path}: {error.strerror or error}; is the twin alive?") from error
    if not answer.pop("ok"):
        raise UsageError(f"the twin refuses: {answer['error']}")
    return answer


def _exchange(path: Path, request: bytes) -> bytes:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        client.settimeout(_TIMEOUT_S)
        client.connect(str(path))
        client.sendall(request)
        reply = bytearray()
        while not reply.endswith(b"\n"):
            data = client.recv(_CHUNK_BYTES)
            if not data:
                raise ConnectionError("the twin hung up")
            reply += data
    return bytes(reply)
