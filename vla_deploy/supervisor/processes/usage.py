"""Measure the memory and CPU of the run's processes; see proc_pid_stat(5)."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import NS_PER_S

_PROC = Path("/proc")
_ENDED_STATES = ("Z", "X")
# Counted after the name and the bracket that closes it, which may itself hold brackets.
_STATE, _PARENT, _USER, _SYSTEM, _START, _RSS = 0, 1, 11, 12, 19, 21
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_GONE = (FileNotFoundError, ProcessLookupError)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessStat:
    """Describe a process; its start, in clock ticks since boot, tells pids used again apart."""

    pid: int
    parent: int
    ended: bool
    start_ticks: int
    cpu_s: float
    rss_bytes: int


def read_stat(pid: int) -> ProcessStat | None:
    """Return the state and the use of a process, or None when there is none.

    Raises:
        PermissionError: it may not be known.
    """
    try:
        text = (_PROC / str(pid) / "stat").read_text()
    except _GONE:
        return None
    fields = text.rpartition(")")[2].split()
    return ProcessStat(
        pid=pid,
        parent=int(fields[_PARENT]),
        ended=fields[_STATE] in _ENDED_STATES,
        start_ticks=int(fields[_START]),
        cpu_s=(int(fields[_USER]) + int(fields[_SYSTEM])) / _TICKS_PER_S,
        rss_bytes=int(fields[_RSS]) * _PAGE_BYTES,
    )


def read_all_stats() -> dict[int, ProcessStat]:
    """Return every process of the computer that may be known, by its pid."""
    pids = (int(path.name) for path in _PROC.iterdir() if path.name.isdecimal())
    return {pid: stat for pid in pids if (stat := _read_if_known(pid)) is not None}


def _read_if_known(pid: int) -> ProcessStat | None:
    # Mounted with hidepid=1, /proc lists other users' processes and opens none of their files.
    try:
        return read_stat(pid)
    except PermissionError:
        return None


def read_pss_bytes(pid: int) -> int | None:
    """Return a process' memory with shared pages counted once, or None when there is none.

    The kernel walks all its pages for this: read it rarely.

    Raises:
        PermissionError: it may not be known.
    """
    try:
        lines = (_PROC / str(pid) / "smaps_rollup").read_text().splitlines()
    except _GONE:
        return None
    kilobytes = next((line.split()[1] for line in lines if line.startswith("Pss:")), None)
    return None if kilobytes is None else 1024 * int(kilobytes)


_MB = 1_000_000
_FAMILY_PERIOD_NS = 2 * NS_PER_S
_CHANGED_SHARE = 0.05

Instance = tuple[int, int]
"""A pid and the start of the process that has it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """Report one process; CPU counts in cores, over the run and all its restarts."""

    memory_mb: float
    rss_mb: float
    cpu_ratio: float
    cpu_s: float


class UsageMeter:
    """Keep the CPU time of every process and the peak memory of all together.

    The descendants of a process count as its own; they are looked up every 2 s. Memory is PSS,
    which counts shared pages once, or RSS where PSS cannot be read; `memory_kind` says which.
    """

    def __init__(self, start_ns: int) -> None:
        self.peak_memory_mb = 0.0
        self._start_ns = start_ns
        self._pids: Mapping[str, int] = {}
        self._families: dict[str, list[Instance]] = {}
        self._families_due_ns = 0
        self._cpu_s: dict[str, dict[Instance, float]] = {}
        self._memory = _Memory()

    @property
    def memory_kind(self) -> str:
        """Return what `memory_mb` is: pss, or rss where one at least cannot be known."""
        return "rss" if self._memory.denied else "pss"

    def sample(self, pids: Mapping[str, int], now_ns: int) -> dict[str, Usage]:
        """Measure every process that still runs."""
        if pids != self._pids or now_ns >= self._families_due_ns:
            self._pids, self._families_due_ns = dict(pids), now_ns + _FAMILY_PERIOD_NS
            self._families = _families(pids)
        found = {name: _running(family) for name, family in self._families.items()}
        members = {name: stats for name, stats in found.items() if stats}
        self._memory.refresh([stat for stats in members.values() for stat in stats])
        elapsed_s = max(now_ns - self._start_ns, 1) / NS_PER_S
        usages = {name: self._usage(name, stats, elapsed_s) for name, stats in members.items()}
        total_mb = sum(usage.memory_mb for usage in usages.values())
        self.peak_memory_mb = max(self.peak_memory_mb, total_mb)
        return usages

    def _usage(self, name: str, stats: list[ProcessStat], elapsed_s: float) -> Usage:
        spent = self._cpu_s.setdefault(name, {})
        spent.update({_instance(stat): stat.cpu_s for stat in stats})
        cpu_s = sum(spent.values())
        return Usage(
            memory_mb=sum(self._memory.bytes_of(stat) for stat in stats) / _MB,
            rss_mb=sum(stat.rss_bytes for stat in stats) / _MB,
            cpu_ratio=cpu_s / elapsed_s,
            cpu_s=cpu_s,
        )


class _Memory:
    """Keep the PSS of processes, which is expensive to read, up to date by their RSS.

    A process whose RSS has changed is measured at once, the others one at a time, in turn.
    """

    def __init__(self) -> None:
        self.denied = False
        self._measured: dict[Instance, tuple[int, int]] = {}

    def refresh(self, stats: list[ProcessStat]) -> None:
        """Measure the processes that need it, and forget those that have ended."""
        present = {_instance(stat): stat for stat in stats}
        self._measured = {key: each for key, each in self._measured.items() if key in present}
        longest_ago = next(iter(self._measured), None)
        for key, stat in present.items():
            if key == longest_ago or self._has_changed(key, stat):
                self._measured.pop(key, None)
                self._measured[key] = self._measure(stat), stat.rss_bytes

    def bytes_of(self, stat: ProcessStat) -> int:
        """Return the last measurement plus the change of RSS since."""
        pss_bytes, rss_bytes = self._measured[_instance(stat)]
        return max(pss_bytes + stat.rss_bytes - rss_bytes, 0)

    def _has_changed(self, key: Instance, stat: ProcessStat) -> bool:
        if key not in self._measured:
            return True
        before = self._measured[key][1]
        return abs(stat.rss_bytes - before) > _CHANGED_SHARE * before

    def _measure(self, stat: ProcessStat) -> int:
        try:
            pss_bytes = read_pss_bytes(stat.pid)
        except PermissionError:
            self.denied = True
            return stat.rss_bytes
        return stat.rss_bytes if pss_bytes is None else pss_bytes


def _instance(stat: ProcessStat) -> Instance:
    return stat.pid, stat.start_ticks


def _running(family: list[Instance]) -> list[ProcessStat]:
    """Return those that still run; the CPU time of one that has ended stays counted."""
    stats = (read_stat(pid) for pid, _ in family)
    return [
        stat for stat in stats if stat is not None and not stat.ended and _instance(stat) in family
    ]


def _families(pids: Mapping[str, int]) -> dict[str, list[Instance]]:
    """Group the named processes with their descendants, by one read of the process list."""
    names = {pid: name for name, pid in pids.items()}
    known = read_all_stats()
    families: dict[str, list[Instance]] = {
        name: [] for name, pid in pids.items() if pid in known and _is_ours(pid, known)
    }
    for stat in known.values():
        name = _named_ancestor(stat.pid, names, known)
        if name in families:
            families[name].append(_instance(stat))
    return families


def _is_ours(pid: int, known: Mapping[int, ProcessStat]) -> bool:
    """Return whether a process is this one or descends from it; a pid may be used again."""
    while pid in known:
        if pid == os.getpid():
            return True
        pid = known[pid].parent
    return False


def _named_ancestor(
    pid: int, names: Mapping[int, str], known: Mapping[int, ProcessStat]
) -> str | None:
    while pid in known:
        if pid in names:
            return names[pid]
        pid = known[pid].parent
    return None
