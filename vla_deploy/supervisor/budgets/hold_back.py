"""Hold a process back from outside, where no control group can: nice, affinity, RLIMIT_DATA.

All of it is undone when the process keeps its budget again. Address space (RLIMIT_AS) is never
limited: memory-mapped models and shared memory count there without being used.
"""

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Final

HELD_NICE: Final = 10
_PROC: Final = Path("/proc")
_MB: Final = 1_000_000
_CAP_SYS_NICE: Final = 1 << 23


class HoldRefused(Exception):
    """Say why a process cannot be held back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CpuHold:
    """Remember what a process had before it was held back."""

    pid: int
    cores: int
    nice: int
    affinity: frozenset[int]

    def __str__(self) -> str:
        return f"nice {max(HELD_NICE, self.nice)} and {self.cores} cores"

    @classmethod
    def take(cls, pid: int, cores: float) -> "CpuHold":
        """Give a process a low claim on the CPU, and only as many cores as its budget has.

        Raises:
            HoldRefused: it is gone or not ours, or what is taken could not be given back.
        """
        with _translated(pid):
            nice = os.getpriority(os.PRIO_PROCESS, pid)
            affinity = frozenset(os.sched_getaffinity(pid))
            _require_undo(nice)
            kept = frozenset(sorted(affinity)[-ceil(cores) :])
            _set_cpu(pid, max(HELD_NICE, nice), kept)
            if os.sched_getaffinity(pid) != kept:
                raise HoldRefused(f"pid {pid} did not take the cores {sorted(kept)}")
        return cls(pid=pid, cores=len(kept), nice=nice, affinity=affinity)

    def release(self) -> None:
        """Give the process back what it had.

        Raises:
            HoldRefused: it is gone or not ours.
        """
        with _translated(self.pid):
            _set_cpu(self.pid, self.nice, self.affinity)


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryHold:
    """Remember the soft limit on private memory that a process had before."""

    pid: int
    limit_bytes: int
    soft: int
    hard: int

    def __str__(self) -> str:
        return f"RLIMIT_DATA {self.limit_bytes / _MB:.0f} MB"

    @classmethod
    def take(cls, pid: int, growth_mb: float) -> "MemoryHold":
        """Let the private memory of a process grow by so much and no more.

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
        """Let the process grow as before.

        Raises:
            HoldRefused: it is gone or not ours.
        """
        with _translated(self.pid):
            resource.prlimit(self.pid, resource.RLIMIT_DATA, (self.soft, self.hard))


@contextmanager
def _translated(pid: int) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise HoldRefused(f"pid {pid}: {error.strerror}") from error


def _set_cpu(pid: int, nice: int, affinity: frozenset[int]) -> None:
    # Both belong to a thread, not to a process.
    for thread in (_PROC / str(pid) / "task").iterdir():
        os.setpriority(os.PRIO_PROCESS, int(thread.name), nice)
        os.sched_setaffinity(int(thread.name), affinity)


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
