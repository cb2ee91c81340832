"""Measure the memory and CPU of the run's processes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import psutil

from drivers.clock import NS_PER_S

_MB = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """Report one process; CPU counts in cores, over the run and all its restarts."""

    memory_mb: float
    rss_mb: float
    cpu_ratio: float
    cpu_s: float


class UsageMeter:
    """Keep the CPU time of every process and the peak memory of all together.

    What a process has started itself counts as its own. Memory is PSS, which counts shared pages
    once; RSS stands in where PSS cannot be read, and `memory_kind` says so.
    """

    def __init__(self, start_ns: int) -> None:
        self.peak_memory_mb = 0.0
        self.memory_kind = "pss"
        self._start_ns = start_ns
        self._cpu_s: dict[tuple[str, int], float] = {}

    def sample(self, pids: Mapping[str, int], now_ns: int) -> dict[str, Usage]:
        """Measure every process that still runs."""
        elapsed_s = max(now_ns - self._start_ns, 1) / NS_PER_S
        usages = {
            name: self._measure(name, members, elapsed_s)
            for name, members in _families(pids).items()
        }
        total_mb = sum(usage.memory_mb for usage in usages.values())
        self.peak_memory_mb = max(self.peak_memory_mb, total_mb)
        return usages

    def _measure(self, name: str, members: Sequence[psutil.Process], elapsed_s: float) -> Usage:
        memory_bytes = rss_bytes = 0
        for process in members:
            try:
                times = process.cpu_times()
                rss = process.memory_info().rss
                memory_bytes += self._proportional_bytes(process, rss)
            except psutil.NoSuchProcess:
                continue  # it ended meanwhile; its CPU time so far stays counted
            rss_bytes += rss
            self._cpu_s[name, process.pid] = times.user + times.system
        spent_s = sum(spent for (owner, _), spent in self._cpu_s.items() if owner == name)
        return Usage(
            memory_mb=memory_bytes / _MB,
            rss_mb=rss_bytes / _MB,
            cpu_ratio=spent_s / elapsed_s,
            cpu_s=spent_s,
        )

    def _proportional_bytes(self, process: psutil.Process, rss_bytes: int) -> int:
        try:
            pss: int = process.memory_full_info().pss
        except psutil.AccessDenied:
            self.memory_kind = "rss"
            return rss_bytes
        return pss


def _families(pids: Mapping[str, int]) -> dict[str, list[psutil.Process]]:
    """Group the named processes with their descendants, by one look at the process list."""
    names = {pid: name for name, pid in pids.items()}
    own = psutil.Process()
    known = {process.pid: process for process in (own, *own.children(recursive=True))}
    families: dict[str, list[psutil.Process]] = {
        name: [] for name, pid in pids.items() if pid in known
    }
    for process in known.values():
        name = _named_ancestor(process.pid, names, known)
        if name is not None:
            families[name].append(process)
    return families


def _named_ancestor(
    pid: int, names: Mapping[int, str], known: Mapping[int, psutil.Process]
) -> str | None:
    while pid in known:
        if pid in names:
            return names[pid]
        try:
            pid = known[pid].ppid()
        except psutil.NoSuchProcess:
            return None
    return None
