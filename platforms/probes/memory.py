"""Read memory from /proc/meminfo, and the GPU's part of it, which a Jetson shares, from nvmap."""

from collections.abc import Iterator, Mapping

from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import Missing, Tree

CLIENTS = "/sys/kernel/debug/nvmap/iovmm/clients"
_UNITS: Mapping[str, int] = {"": 1, "B": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30}
_ROW_WORDS = 4  # client, process, pid, size


class MemorySource:
    """Read memory and swap."""

    def __init__(self, tree: Tree) -> None:
        self._meminfo = tree.file("/proc/meminfo")

    def readings(self) -> Iterator[Reading]:
        """Return sizes in bytes."""
        try:
            rows = meminfo_bytes(self._meminfo.text())
        except Missing as missing:
            rows, because = {}, str(missing)
        else:
            because = ""

        def row(key: str) -> float:
            if key not in rows:
                raise Missing(because or f"/proc/meminfo has no {key}")
            return rows[key]

        yield measure("memory_total_bytes", "bytes", lambda: row("MemTotal"))
        yield measure("memory_available_bytes", "bytes", lambda: row("MemAvailable"))
        yield measure("swap_total_bytes", "bytes", lambda: row("SwapTotal"))
        yield measure("swap_used_bytes", "bytes", lambda: row("SwapTotal") - row("SwapFree"))
        yield measure("gpu_memory_used_bytes", "bytes", lambda: row("NvMapMemUsed"))


def meminfo_bytes(text: str) -> dict[str, float]:
    """Return the rows of /proc/meminfo that are sizes; others are passed over."""
    rows: dict[str, float] = {}
    for line in text.splitlines():
        key, _, rest = line.partition(":")
        words = rest.split()
        if len(words) == 2 and words[1] == "kB" and words[0].isdecimal():
            rows[key] = int(words[0]) * 1024.0
    return rows


class NvmapSource:
    """Read how much GPU memory each process holds; the kernel shows it to root."""

    def __init__(self, tree: Tree) -> None:
        self._clients = tree.file(CLIENTS)

    def readings(self) -> Iterator[Reading]:
        """Return the sum, then one reading `gpu_memory_used_bytes.<pid>` per process."""
        try:
            sizes = nvmap_bytes(self._clients.text())
        except Missing as missing:
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
    for line in text.splitlines():
        words = line.split()
        if len(words) != _ROW_WORDS or not words[2].isdecimal():
            continue  # the head, the total, and a blank line
        number = words[3].rstrip("BKMG")
        factor = _UNITS.get(words[3][len(number) :].removesuffix("B") or "B")
        if factor is None or not number.isdecimal():
            raise Missing(f"{CLIENTS} holds the size {words[3]!r}")
        pid = int(words[2])
        sizes[pid] = sizes.get(pid, 0.0) + int(number) * factor
    if not sizes and "CLIENT" not in text:
        raise Missing(f"{CLIENTS} holds no table of clients")
    return sizes
