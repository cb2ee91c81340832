"""Speak the journal's native protocol: one datagram per entry, fields that can be searched."""

import logging
import socket
from collections.abc import Mapping
from pathlib import Path

JOURNAL_SOCKET = Path("/run/systemd/journal/socket")
_MOST_BYTES = 64_000  # a larger entry needs a file of its own; no line of ours is worth one
_PRIORITIES = (
    (logging.CRITICAL, 2),
    (logging.ERROR, 3),
    (logging.WARNING, 4),
    (logging.INFO, 6),
)
_DEBUG_PRIORITY = 7


class JournalHandler(logging.Handler):
    """Send records to journald; `refused` counts those that it did not take at once."""

    def __init__(self, path: Path, fields: Mapping[str, str]) -> None:
        super().__init__()
        self.refused = 0
        self._path = str(path)
        self._fields = fields
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)

    def emit(self, record: logging.LogRecord) -> None:
        """Send one entry, or count it as refused."""
        text = record.getMessage()
        if record.exc_text:
            text = f"{text}\n{record.exc_text}"
        entry = {
            "MESSAGE": text,
            "PRIORITY": str(priority(record.levelno)),
            "CODE_FILE": record.pathname,
            "CODE_LINE": str(record.lineno),
            "CODE_FUNC": record.funcName or "",
            "SYSLOG_PID": str(record.process),
            **self._fields,
        }
        try:
            self._socket.sendto(encode(entry), self._path)
        except OSError:
            self.refused += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
        super().close()


def priority(level: int) -> int:
    """Return the syslog priority of a level of the logging module."""
    return next((number for least, number in _PRIORITIES if level >= least), _DEBUG_PRIORITY)


def encode(entry: Mapping[str, str]) -> bytes:
    """Return an entry on the wire; a value of several lines is preceded by its length."""
    return b"".join(_field(name, value) for name, value in entry.items())


def _field(name: str, value: str) -> bytes:
    data = value.encode(errors="replace")[:_MOST_BYTES]
    if b"\n" not in data:
        return name.encode() + b"=" + data + b"\n"
    return name.encode() + b"\n" + len(data).to_bytes(8, "little") + data + b"\n"
