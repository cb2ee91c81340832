"""Read what the kernel tells of one process, with one system file each; see proc_pid_stat(5)."""

import os
from dataclasses import dataclass
from pathlib import Path

_PROC = Path("/proc")
_ENDED_STATES = ("Z", "X")
# Counted after the name and the bracket that closes it, which may itself hold brackets.
_STATE, _PARENT, _USER, _SYSTEM, _START, _RSS = 0, 1, 11, 12, 19, 21
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_GONE = (FileNotFoundError, ProcessLookupError)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessStat:
    """Describe a process; the start, in clock ticks since boot, tells it from a later one."""

    pid: int
    parent: int
    ended: bool
    start_ticks: int
    cpu_s: float
    rss_bytes: int


def read_stat(pid: int) -> ProcessStat | None:
    """Return what a process is and takes, or None when there is none.

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

    The kernel goes through all its pages for this: rarely, please.

    Raises:
        PermissionError: it may not be known.
    """
    try:
        lines = (_PROC / str(pid) / "smaps_rollup").read_text().splitlines()
    except _GONE:
        return None
    kilobytes = next((line.split()[1] for line in lines if line.startswith("Pss:")), None)
    return None if kilobytes is None else 1024 * int(kilobytes)
