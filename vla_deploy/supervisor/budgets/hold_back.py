"""Hold a process back from outside, where no control group can: nice, affinity, RLIMIT_DATA.

All of it is undone when the process keeps its budget again, except what has been changed from
elsewhere: a process that follows another profile sets its own affinity. Address space (RLIMIT_AS)
is never limited: memory-mapped models and shared memory count there without being used.
"""

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Final

HELD_NICE: Final = 10
_PROC: Final = Path("/proc")
_MB: Final = 1_000_000
_CAP_SYS_NICE: Final = 1 << 23


class HoldRefused(Exception):
    """Give the reason why a process cannot be held back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Claim:
    """Hold what the kernel grants one thread: its nice, and the cores that it may run on."""

    nice: int
    cores: frozenset[int]

    @classmethod
    def of(cls, thread: int) -> "_Claim":
        return cls(
            nice=os.getpriority(os.PRIO_PROCESS, thread),
            cores=frozenset(os.sched_getaffinity(thread)),
        )

    def set(self, thread: int) -> None:
        os.setpriority(os.PRIO_PROCESS, thread, self.nice)
        os.sched_setaffinity(thread, self.cores)

    def held(self, cores: frozenset[int]) -> "_Claim":
        """Return the low claim that this becomes; one that is lower already stays so."""
        return _Claim(nice=max(HELD_NICE, self.nice), cores=cores)


@dataclass(frozen=True, slots=True, kw_only=True)
class CpuHold:
    """Keep what each thread of a process had before it was held back."""

    pid: int
    cores: frozenset[int]
    before: dict[int, _Claim] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"nice {self.before[self.pid].held(self.cores).nice} and {len(self.cores)} cores"

    @classmethod
    def take(cls, pid: int, cores: float) -> "CpuHold":
        """Give a process a low claim on the CPU, and only as many cores as its budget has.

        Raises:
            HoldRefused: it is gone or not ours, or what is taken could not be given back.
        """
        with _translated(pid):
            main = _Claim.of(pid)
            _require_undo(main.nice)
            hold = cls(pid=pid, cores=frozenset(sorted(main.cores)[-ceil(cores) :]))
            try:
                hold._take_every_thread()
            except (OSError, HoldRefused):
                hold.release()
                raise
        return hold

    def release(self) -> None:
        """Restore what each thread had; a process that has ended needs nothing.

        Raises:
            HoldRefused: it is not ours.
        """
        with _translated(self.pid):
            for thread in _threads(self.pid):
                with suppress(ProcessLookupError):  # it has ended
                    self._release_thread(thread)

    def _take_every_thread(self) -> None:
        # A thread that is started by one not held yet inherits the high claim.
        seen: set[int] = set()
        while new := _threads(self.pid) - seen:
            seen |= new
            for thread in new:
                with suppress(ProcessLookupError):
                    self._take_thread(thread)
        if self.pid not in self.before or _Claim.of(self.pid).cores != self.cores:
            raise HoldRefused(f"pid {self.pid} did not take the cores {sorted(self.cores)}")

    def _take_thread(self, thread: int) -> None:
        self.before[thread] = _Claim.of(thread)
        self.before[thread].held(self.cores).set(thread)

    def _release_thread(self, thread: int) -> None:
        """Restore what is still as the hold left it; later threads inherited their claim."""
        before = self.before.get(thread) or self.before.get(self.pid)
        if before is None:
            return
        now, held = _Claim.of(thread), before.held(self.cores)
        _Claim(
            nice=before.nice if now.nice == held.nice else now.nice,
            cores=before.cores if now.cores == held.cores else now.cores,
        ).set(thread)


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryHold:
    """Keep the soft limit on private memory that a process had before."""

    pid: int
    limit_bytes: int
    soft: int
    hard: int

    def __str__(self) -> str:
        return f"RLIMIT_DATA {self.limit_bytes / _MB:.0f} MB"

    @classmethod
    def take(cls, pid: int, growth_mb: float) -> "MemoryHold":
        """Limit the growth of a process' private memory.

        Raises:
            HoldRefused: it is gone or not ours, or the limit does not read back.
        """
        with _translated(pid):
            soft, hard = resource.prlimit(pid, resource.RLIMIT_DATA)
            limit = _private_bytes(pid) + max(0, round(growth_mb * _MB))
            if hard != resource.RLIM_INFINITY:
                limit = min(limit, hard)
            resource.prlimit(pid, resource.RLIMIT_DATA, (limit, hard))
            if resource.prlimit(pid, resource.RLIMIT_DATA)[0] != limit:
                raise HoldRefused(f"pid {pid} did not take RLIMIT_DATA")
        return cls(pid=pid, limit_bytes=limit, soft=soft, hard=hard)

    def release(self) -> None:
        """Restore the limit; a process that has ended needs nothing.

        Raises:
            HoldRefused: it is not ours.
        """
        with _translated(self.pid), suppress(ProcessLookupError):
            if resource.prlimit(self.pid, resource.RLIMIT_DATA)[0] == self.limit_bytes:
                resource.prlimit(self.pid, resource.RLIMIT_DATA, (self.soft, self.hard))


@contextmanager
def _translated(pid: int) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise HoldRefused(f"pid {pid}: {error.strerror}") from error


def _threads(pid: int) -> set[int]:
    """Return the threads of a process, none if it has ended: nice and cores belong to each."""
    try:
        return {int(path.name) for path in (_PROC / str(pid) / "task").iterdir()}
    except (FileNotFoundError, ProcessLookupError):
        return set()


def _require_undo(nice: int) -> None:
    """Refuse what this process may raise but not lower again."""
    limit = resource.getrlimit(resource.RLIMIT_NICE)[0]
    may_lower = limit == resource.RLIM_INFINITY or 20 - limit <= nice
    if not may_lower and not int(_status("self", "CapEff"), 16) & _CAP_SYS_NICE:
        raise HoldRefused(
            "nice could not be lowered again: grant CAP_SYS_NICE or LimitNICE (the unit does)"
        )


def _private_bytes(pid: int) -> int:
    return int(_status(pid, "VmData").split()[0]) * 1024


def _status(pid: int | str, key: str) -> str:
    for line in (_PROC / str(pid) / "status").read_text().splitlines():
        if line.startswith(f"{key}:"):
            return line.removeprefix(f"{key}:").strip()
    raise HoldRefused(f"pid {pid} has no {key}: it is ending")
