"""Read the load and clock of a Jetson's GPU from devfreq, and the load of its memory bus."""

from collections.abc import Iterator, Mapping
from typing import Final

from platforms.probes.discovery import Discovery
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree, ValueMissing

DEVFREQ: Final = "/sys/class/devfreq"
# The device tree's names of the integrated GPUs; Thor lists clocks only, under a name of its own.
GPU_NODES: Final = frozenset({"gpu", "ga10b", "gv11b", "gp10b", "gb10b"})
CLOCK_ONLY: Final = "gpu-gpc-0"
EMC_CLOCK: Final = "/sys/kernel/debug/bpmp/debug/clk/emc/rate"
EMC_ACTIVITY: Final = "/sys/kernel/debug/cactmon/mc_all"
_PER_MILLE: Final = 1000.0
_KHZ_PER_HZ: Final = 1e-3


class GpuSource:
    """Read the integrated GPU, which may appear late."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        self._nodes = Discovery(tree, DEVFREQ, self._find)

    def readings(self) -> Iterator[Reading]:
        """Return load and clocks."""
        files = self._nodes.current()
        yield self._measured(files, "load", "gpu_load_ratio", "ratio", 1 / _PER_MILLE, most=1.0)
        yield self._measured(files, "cur_freq", "gpu_frequency_hz", "Hz", 1.0)
        yield self._measured(files, "max_freq", "gpu_frequency_limit_hz", "Hz", 1.0)

    def _measured(
        self,
        files: Mapping[str, SystemFile],
        key: str,
        name: str,
        unit: str,
        factor: float,
        most: float = float("inf"),
    ) -> Reading:
        file = files.get(key)
        if file is None:
            whose = "a GPU's load" if files else "a GPU"
            return lacking(name, unit, f"no node below {DEVFREQ} tells {whose}")
        return measure(name, unit, lambda: within(file.number() * factor, most, file))

    def _find(self, names: tuple[str, ...]) -> dict[str, SystemFile]:
        for name in names:
            folder = f"{DEVFREQ}/{name}"
            clocks = {key: self._tree.file(f"{folder}/{key}") for key in ("cur_freq", "max_freq")}
            if name == CLOCK_ONLY:
                return clocks
            if self._node_name(folder) in GPU_NODES:
                return {**clocks, "load": self._tree.file(f"{folder}/device/load")}
        return {}

    def _node_name(self, folder: str) -> str:
        try:
            return self._tree.text(f"{folder}/device/of_node/name")
        except ValueMissing:
            return ""


class MemoryBusSource:
    """Read how busy the external memory controller (EMC) is; the kernel shows it to root."""

    def __init__(self, tree: Tree) -> None:
        self._rate, self._activity = tree.file(EMC_CLOCK), tree.file(EMC_ACTIVITY)

    def readings(self) -> Iterator[Reading]:
        """Return clock and load."""
        yield measure("emc_frequency_hz", "Hz", self._rate.number)
        yield measure("emc_load_ratio", "ratio", self._load)

    def _load(self) -> float:
        rate_khz = self._rate.number() * _KHZ_PER_HZ
        if rate_khz <= 0:
            raise ValueMissing(f"{self._rate} tells no clock")
        # activity / kHz is per cent, as every monitor of these boards has it
        return within(self._activity.number() / rate_khz / 100, 1.0, self._activity)


def within(value: float, most: float, where: SystemFile) -> float:
    """Return the value.

    Raises:
        Missing: it is below 0 or above `most`, so the file means something else.
    """
    if not 0 <= value <= most:
        raise ValueMissing(f"{where} makes {value:g}, expected 0 to {most:g}")
    return value
