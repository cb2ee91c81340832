"""Measure the memory and CPU of the run's processes."""

from collections.abc import Mapping
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


@dataclass(slots=True)
class _Spent:
    pid: int = 0
    cpu_s: float = 0.0
    earlier_cpu_s: float = 0.0


class UsageMeter:
    """Keep the CPU time of every process and the peak memory of all together.

    Memory is PSS, which counts shared pages once; RSS stands in where PSS cannot be read, and
    `memory_kind` says so.
    """

    def __init__(self, start_ns: int) -> None:
        self.peak_memory_mb = 0.0
        self.memory_kind = "pss"
        self._start_ns = start_ns
        self._spent: dict[str, _Spent] = {}

    def sample(self, pids: Mapping[str, int], now_ns: int) -> dict[str, Usage]:
        """Measure every process that still runs."""
        elapsed_s = max(now_ns - self._start_ns, 1) / NS_PER_S
        usages: dict[str, Usage] = {}
        for name, pid in pids.items():
            try:
                usages[name] = self._measure(name, pid, elapsed_s)
            except psutil.NoSuchProcess:
                continue  # it ended meanwhile; its CPU time so far stays counted
        total_mb = sum(usage.memory_mb for usage in usages.values())
        self.peak_memory_mb = max(self.peak_memory_mb, total_mb)
        return usages

    def _measure(self, name: str, pid: int, elapsed_s: float) -> Usage:
        process = psutil.Process(pid)
        times = process.cpu_times()
        rss_bytes = process.memory_info().rss
        spent = self._spent.setdefault(name, _Spent(pid=pid))
        if spent.pid != pid:
            spent.earlier_cpu_s += spent.cpu_s
            spent.pid = pid
        spent.cpu_s = times.user + times.system
        return Usage(
            memory_mb=self._proportional_bytes(process, rss_bytes) / _MB,
            rss_mb=rss_bytes / _MB,
            cpu_ratio=(spent.cpu_s + spent.earlier_cpu_s) / elapsed_s,
        )

    def _proportional_bytes(self, process: psutil.Process, rss_bytes: int) -> int:
        try:
            pss: int = process.memory_full_info().pss
        except psutil.AccessDenied:
            self.memory_kind = "rss"
            return rss_bytes
        return pss
