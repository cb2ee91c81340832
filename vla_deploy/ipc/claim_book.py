"""Share the claims on resources between the processes of one run."""

import fcntl
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.claims import Book, Claim, ask, declare, obstacles, release, settle
from vla_deploy.ipc.errors import SpaceUnavailable

FILE_NAME: Final = "claims.json"
_START_TIME_FIELD: Final = 19  # of /proc/<pid>/stat, counted behind the name


class ClaimBook:
    """Keep the claims in a file of the run, under a lock that the kernel gives back.

    A claim belongs to the process that made it and ends with it, however it ends.

    Raises:
        SpaceUnavailable: the file cannot be opened.
    """

    def __init__(self, directory: Path, clock: Clock) -> None:
        self._path = directory / FILE_NAME
        self._clock = clock
        self._pid = os.getpid()
        self._pid_started = _start_time(self._pid) or 0

    def declare(self, capacities: Mapping[str, int]) -> None:
        """Say how much there is of some resources."""
        self._change(lambda book, now_ns: declare(book, capacities, now_ns))

    def ask(
        self, holder: str, wants: Mapping[str, int], *, priority: int = 0, timeout_s: float = 0.0
    ) -> bool:
        """Ask for all of `wants` at once; return whether it was granted, or waits.

        Raises:
            ClaimRefused: there is no such resource, never that much of it, or the holder has asked
                already.
        """
        now_ns = self._clock.now_ns()
        claim = Claim(
            holder=holder,
            wants=dict(wants),
            priority=priority,
            expires_ns=now_ns + round(timeout_s * NS_PER_S) if timeout_s else 0,
            pid=self._pid,
            pid_started=self._pid_started,
        )
        return self._change(lambda book, at_ns: ask(book, claim, at_ns)).holds(holder)

    def look(self) -> Book:
        """Return the claims of those that still live, after serving those that wait."""
        return self._change(settle)

    def release(self, *holders: str) -> None:
        """Give back what holders have or wait for; releasing nothing is allowed."""
        self._change(lambda book, now_ns: release(book, holders, now_ns))

    def obstacles(self, wants: Mapping[str, int]) -> str:
        """Say who holds what stands in the way."""
        return obstacles(self.look(), wants)

    def _change(self, change: Callable[[Book, int], Book]) -> Book:
        with self._locked():
            before = self._read()
            dead = [one.holder for one in (*before.granted, *before.waiting) if not _is_alive(one)]
            now_ns = self._clock.now_ns()
            after = change(release(before, dead, now_ns) if dead else before, now_ns)
            if after != before:
                self._write(after)
        return after

    @contextmanager
    def _locked(self) -> Iterator[None]:
        lock = self._path.with_suffix(".lock")
        try:
            fd = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o660)
        except OSError as error:
            raise SpaceUnavailable(f"{lock}: cannot open it: {error.strerror}") from error
        try:
            fcntl.flock(fd, fcntl.LOCK_EX)
            yield
        finally:
            os.close(fd)

    def _read(self) -> Book:
        try:
            document = json.loads(self._path.read_bytes())
        except FileNotFoundError:
            return Book()
        return replace(
            Book(capacities=document["capacities"]),
            granted=tuple(Claim(**claim) for claim in document["granted"]),
            waiting=tuple(Claim(**claim) for claim in document["waiting"]),
        )

    def _write(self, book: Book) -> None:
        fresh = self._path.with_suffix(f".{self._pid}")
        fresh.write_text(json.dumps(asdict(book)))
        fresh.replace(self._path)  # whoever is killed half way leaves the old book whole


def _is_alive(claim: Claim) -> bool:
    return _start_time(claim.pid) == claim.pid_started


def _start_time(pid: int) -> int | None:
    """Return when a process started, which tells it from a later one of its pid."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return None
    fields = stat.rpartition(")")[2].split()
    return None if fields[0] == "Z" else int(fields[_START_TIME_FIELD])
