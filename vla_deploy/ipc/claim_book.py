"""Share the claims on resources between the processes of one run."""

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.claims import (
    Book,
    Claim,
    amend,
    ask,
    declare,
    obstacles,
    release,
    settle,
    widen,
)
from vla_deploy.ipc.errors import BadPayload, ClaimRefused
from vla_deploy.ipc.space import SharedSpace
from vla_deploy.ipc.topics import CLAIMS

_START_TIME_FIELD: Final = 19  # of /proc/<pid>/stat, counted behind the name


class ClaimBook:
    """Keep the claims in shared memory; one process at a time changes them.

    A claim belongs to the process that made it and ends with it, however it ends.
    """

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        """Open the claims of the run that `space` belongs to.

        Raises:
            SpaceUnavailable: shared memory cannot be opened.
        """
        self._shared = space.shared_document(CLAIMS)
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
            ClaimRefused: there is no such resource, never that much of it, the holder has asked
                already, or there are too many claims.
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

    def amend(self, holder: str, wants: Mapping[str, int]) -> None:
        """Correct what a holder was granted by what it really takes; others wait where it is more.

        Raises:
            ClaimRefused: there are too many claims.
        """
        self._change(lambda book, now_ns: amend(book, holder, wants, now_ns))

    def widen(self, holder: str, wants: Mapping[str, int]) -> bool:
        """Give a holder more than it has kept, where that is free; return whether it has it."""
        book = self._change(lambda book, _: widen(book, holder, wants))
        return any(one.holder == holder and one.wants == wants for one in book.granted)

    def obstacles(self, wants: Mapping[str, int]) -> str:
        """Say who holds what stands in the way."""
        return obstacles(self.look(), wants)

    def _change(self, change: Callable[[Book, int], Book]) -> Book:
        def turn(before: dict[str, Any] | None) -> dict[str, Any]:
            book = _book_of(before)
            dead = [one.holder for one in (*book.granted, *book.waiting) if not _is_alive(one)]
            now_ns = self._clock.now_ns()
            return _document_of(change(release(book, dead, now_ns) if dead else book, now_ns))

        try:
            return _book_of(self._shared.change(turn))
        except BadPayload as error:
            raise ClaimRefused(f"too many claims at once: {error}") from error


def _book_of(document: dict[str, Any] | None) -> Book:
    if document is None:
        return Book()
    return Book(
        capacities=document["capacities"],
        granted=tuple(Claim(**claim) for claim in document["granted"]),
        waiting=tuple(Claim(**claim) for claim in document["waiting"]),
    )


def _document_of(book: Book) -> dict[str, Any]:
    return {
        "capacities": dict(book.capacities),
        "granted": [asdict(claim) for claim in book.granted],
        "waiting": [asdict(claim) for claim in book.waiting],
    }


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
