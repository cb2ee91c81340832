"""Read all sources of one computer together."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from platforms.probes.cgroup import CgroupSource
from platforms.probes.cpu import CpuFrequencySource, CpuSource, PressureSource
from platforms.probes.devfreq import GpuSource, MemoryBusSource
from platforms.probes.discovery import Hwmon
from platforms.probes.disk import DiskSource
from platforms.probes.fan import FanSource
from platforms.probes.memory import MemorySource, NvmapSource
from platforms.probes.nvml import NvmlSource
from platforms.probes.power_mode import PowerModeSource
from platforms.probes.power_rails import PowerSource
from platforms.probes.reading import Reading, ReadingSource
from platforms.probes.thermal import ThermalSource, hottest
from platforms.probes.throttling import ThrottleSource
from platforms.tree import Tree


class ProbeSet:
    """Read everything that this computer tells of itself; files stay open between two reads."""

    def __init__(
        self, tree: Tree, sources: Sequence[ReadingSource], nvml: NvmlSource | None
    ) -> None:
        self._tree, self._nvml = tree, nvml
        self._sources = (*sources, nvml) if nvml is not None else tuple(sources)

    def read(self) -> dict[str, Reading]:
        """Return every reading by its name; where two sources know one, the first that has it."""
        readings: dict[str, Reading] = {}
        for source in self._sources:
            for reading in source.readings():
                readings[reading.name] = _better(readings.get(reading.name), reading)
        readings["temperature_c"] = hottest(readings.values())
        return readings

    def close(self) -> None:
        """Give all handles back."""
        if self._nvml is not None:
            self._nvml.close()
        self._tree.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_probes(
    root: Path = Path("/"), *, disk_folders: Sequence[Path] = (Path("/"),), nvml: bool | None = None
) -> ProbeSet:
    """Open the probes below a root; NVML, which has no root, is asked for `/` only by default."""
    tree = Tree(root)
    hwmon = Hwmon(tree)
    sources: tuple[ReadingSource, ...] = (
        CpuSource(tree),
        CpuFrequencySource(tree),
        PressureSource(tree),
        NvmapSource(tree),  # before the sum that /proc/meminfo tells
        MemorySource(tree),
        CgroupSource(tree),
        GpuSource(tree),
        MemoryBusSource(tree),
        PowerSource(tree, hwmon),
        ThermalSource(tree),
        ThrottleSource(tree, hwmon),
        FanSource(tree, hwmon),
        PowerModeSource(tree),
        DiskSource(tree, disk_folders),
    )
    with_nvml = root == Path("/") if nvml is None else nvml
    return ProbeSet(tree, sources, NvmlSource() if with_nvml else None)


def _better(first: Reading | None, second: Reading) -> Reading:
    if first is None:
        return second
    if first.value is not None or second.value is not None:
        return first if first.value is not None else second
    reason = f"{first.reason}; {second.reason.removeprefix('missing, because ')}"
    return Reading(name=first.name, value=None, unit=first.unit, reason=reason)
