"""Read memory from /proc/meminfo, and the GPU's part of it, which a Jetson shares, from nvmap."""

import re
from collections.abc import Iterator, Mapping
from typing import Final

from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import Tree, ValueMissing

CLIENTS: Final = "/sys/kernel/debug/nvmap/iovmm/clients"
_SIZE_ROW: Final = re.compile(r"^(\w+):\s+(\d{1,15}) kB$", re.MULTILINE | re.ASCII)
_CLIENT_ROW: Final = re.compile(
    r"^[ \t]*\S+[ \t]+\S+[ \t]+(\d{1,9})[ \t]+(\S+)[ \t]*$", re.MULTILINE | re.ASCII
)
_CLIENT_SIZE: Final = re.compile(r"(\d{1,15})([KMG]?)B?", re.ASCII)
_FACTORS: Mapping[str, int] = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


class MemorySource:
    """Read memory and swap."""

    def __init__(self, tree: Tree) -> None:
        self._meminfo = tree.file("/proc/meminfo")

    def readings(self) -> Iterator[Reading]:
        """Return sizes in bytes."""
        try:
            rows = meminfo_bytes(self._meminfo.text())
        except ValueMissing as missing:
            rows, because = {}, str(missing)
        else:
            because = ""

        def row(key: str) -> float:
            if key not in rows:
                raise ValueMissing(because or f"/proc/meminfo has no {key}")
            return rows[key]

        yield measure("memory_total_bytes", "bytes", lambda: row("MemTotal"))
        yield measure("memory_available_bytes", "bytes", lambda: row("MemAvailable"))
        yield measure("swap_total_bytes", "bytes", lambda: row("SwapTotal"))
        yield measure("swap_used_bytes", "bytes", lambda: row("SwapTotal") - row("SwapFree"))
        yield measure("gpu_memory_used_bytes", "bytes", lambda: row("NvMapMemUsed"))


def meminfo_bytes(text: str) -> dict[str, float]:
    """Return the rows of /proc/meminfo that are sizes; others are passed over."""
    return {key: int(size) * 1024.0 for key, size in _SIZE_ROW.findall(text)}


class NvmapSource:
    """Read how much GPU memory each process holds; the kernel shows it to root."""

    def __init__(self, tree: Tree) -> None:
        self._clients = tree.file(CLIENTS)

    def readings(self) -> Iterator[Reading]:
        """Return the sum, then one reading `gpu_memory_used_bytes.<pid>` per process."""
        try:
            sizes = nvmap_bytes(self._clients.text())
        except ValueMissing as missing:
            yield lacking("gpu_memory_used_bytes", "bytes", str(missing))
            return
        yield Reading(name="gpu_memory_used_bytes", value=sum(sizes.values()), unit="bytes")
        for pid, size in sizes.items():
            yield Reading(name=f"gpu_memory_used_bytes.{pid}", value=size, unit="bytes")


def nvmap_bytes(text: str) -> dict[int, float]:
    """Return bytes by pid of a table of clients, whose size ends in K, M or nothing.

    Raises:
        Missing: a row is not of that kind.
    """
    sizes: dict[int, float] = {}
    for pid, size in _CLIENT_ROW.findall(text):  # neither the head nor the total has a pid
        found = _CLIENT_SIZE.fullmatch(size)
        if found is None:
            raise ValueMissing(f"{CLIENTS} holds the size {size!r}")
        sizes[int(pid)] = sizes.get(int(pid), 0.0) + int(found[1]) * _FACTORS[found[2]]
    if not sizes and "CLIENT" not in text:
        raise ValueMissing(f"{CLIENTS} holds no table of clients")
    return sizes
