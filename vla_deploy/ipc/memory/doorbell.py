"""Wake a waiting process by an empty datagram; whoever rings never waits."""

import contextlib
import itertools
import os
import select
import socket
import weakref
from collections.abc import Iterator
from pathlib import Path

from drivers.clock import Clock, waiter_of

_counter = itertools.count()


class Doorbell:
    """Listen for the writers of one topic.

    A full queue or a missed ring costs nothing: the listener reads shared memory when it wakes.
    """

    def __init__(self, directory: Path, topic: str, clock: Clock) -> None:
        folder = _folder(directory, topic)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._path = folder / f"{os.getpid()}.{next(_counter)}"
        self._path.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        with short_path(folder) as short:
            self._socket.bind(f"{short}/{self._path.name}")
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        self._wait_readable = waiter_of(clock)
        self._close = weakref.finalize(self, _close, self._socket, self._path)

    def wait(self, deadline_ns: int) -> bool:
        """Return True when the bell rang, False at `deadline_ns` of the injected clock."""
        ready = self._wait_readable(self._poll, deadline_ns)
        self._forget_rings()
        return ready

    def close(self) -> None:
        """Stop listening; closing twice is allowed."""
        self._close()

    def _forget_rings(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                self._socket.recv(1)


def ring_bells(directory: Path, topic: str) -> int:
    """Ring every listener of a topic without waiting; return how many did not hear it.

    A listener that has died is forgotten.
    """
    folder = _folder(directory, topic)
    try:
        names = [path.name for path in folder.iterdir()]
    except FileNotFoundError:
        return 0
    if not names:
        return 0
    with short_path(folder) as short, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.setblocking(False)
        return sum(not _ring(sender, f"{short}/{name}") for name in names)


def _ring(sender: socket.socket, address: str) -> bool:
    try:
        sender.sendto(b"", address)
    except BlockingIOError:
        return False  # its queue is full: it has been rung already
    except (ConnectionRefusedError, FileNotFoundError):
        Path(address).unlink(missing_ok=True)
        return False
    return True


def _folder(directory: Path, topic: str) -> Path:
    return directory / "bells" / topic


@contextlib.contextmanager
def short_path(folder: Path) -> Iterator[str]:
    """Give a folder a short name: a socket address ends at 107 bytes, a run directory may not."""
    fd = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{fd}"
    finally:
        os.close(fd)


def _close(listener: socket.socket, path: Path) -> None:
    listener.close()
    path.unlink(missing_ok=True)
