"""Ask the kernel which user is at the other end of a Unix socket."""

import os
import socket
import struct
from typing import Final

_CREDENTIALS: Final = struct.Struct("3i")  # pid, uid, gid: `struct ucred`, unix(7)
_ROOT: Final = 0


def is_own_user(connection: socket.socket) -> bool:
    """Return whether the other end was opened by this process's user, or by root.

    The mode of the socket's file says who may connect; this holds also where the file lies in a
    folder that somebody has opened for others.
    """
    try:
        raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    except OSError:
        return False
    _, uid, _ = _CREDENTIALS.unpack(raw)
    return uid in (_ROOT, os.geteuid())
