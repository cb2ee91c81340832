"""Ask root's service for a power mode: the robot's own may not set one."""

import socket
from pathlib import Path
from typing import Final

SOCKET: Final = "run/vla-deploy-power.socket"


def ask_for_mode(path: Path, number: int, timeout_s: float) -> str:
    """Ask for the mode with nvpmodel's `number`, and return the answer once it is done.

    Raises:
        OSError: nobody listens or answers in time, or this user may not ask.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as line:
        line.settimeout(timeout_s)
        line.connect(str(path))
        line.sendall(f"{number}\n".encode())
        with line.makefile(encoding="utf-8", errors="replace") as answer:
            return answer.readline().strip()
