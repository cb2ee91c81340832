"""Read NVIDIA GPUs through NVML, where nvidia-ml-py (the extra `nvml`) and a driver are there."""

import importlib
from collections.abc import Iterator
from functools import partial
from types import ModuleType
from typing import Any, Final

from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import ValueMissing

READS_BETWEEN_TRIALS: Final = 60  # a driver may be loaded late, and asking for it is not cheap
_PERCENT: Final = 100.0
_W_PER_MW: Final = 1e-3
_GPU_SENSOR: Final = 0  # NVML_TEMPERATURE_GPU
_MISSING_UNITS: Final = {"gpu_load_ratio": "ratio", "gpu_memory_used_bytes": "bytes"}


class NvmlSource:
    """Read every GPU that the driver knows."""

    def __init__(self) -> None:
        self._nvml: ModuleType | None = None
        self._devices: tuple[Any, ...] = ()
        self._reason = ""
        self._wait = 0

    def readings(self) -> Iterator[Reading]:
        """Return load and memory of all GPUs, then power and temperature of each."""
        if not self._devices:
            self._open()
        if self._nvml is None or not self._devices:
            for name, unit in _MISSING_UNITS.items():
                yield lacking(name, unit, self._reason)
            return
        yield measure("gpu_load_ratio", "ratio", self._load_ratio)
        yield from self._of_processes()
        yield measure("gpu_memory_used_bytes", "bytes", partial(self._memory, "used"))
        yield measure("gpu_memory_total_bytes", "bytes", partial(self._memory, "total"))
        for index, device in enumerate(self._devices):
            yield from self._of_device(index, device)

    def close(self) -> None:
        """Give the library back."""
        if self._nvml is not None and self._devices:
            self._ask("nvmlShutdown")
            self._devices = ()

    def _open(self) -> None:
        self._wait -= 1
        if self._wait > 0:
            return
        self._wait = READS_BETWEEN_TRIALS
        try:
            self._nvml = importlib.import_module("pynvml")
        except ImportError:
            self._reason = "nvidia-ml-py is not installed: pip install 'vla-deploy[nvml]'"
            return
        try:
            self._ask("nvmlInit")
            count = self._ask("nvmlDeviceGetCount")
            self._devices = tuple(
                self._ask("nvmlDeviceGetHandleByIndex", index) for index in range(count)
            )
        except ValueMissing as missing:
            self._reason = str(missing)
        else:
            self._reason = "NVML knows no GPU"

    def _ask(self, function: str, *arguments: Any) -> Any:
        nvml: Any = self._nvml
        try:
            return getattr(nvml, function)(*arguments)
        except nvml.NVMLError as error:
            raise ValueMissing(f"{function}: {error}") from error

    def _load_ratio(self) -> float:
        loads = [self._ask("nvmlDeviceGetUtilizationRates", one).gpu for one in self._devices]
        return float(max(loads)) / _PERCENT

    def _memory(self, field: str) -> float:
        infos = [self._ask("nvmlDeviceGetMemoryInfo", one) for one in self._devices]
        return float(sum(getattr(info, field) for info in infos))

    def _of_processes(self) -> Iterator[Reading]:
        """Give each process' memory; their sum stands in where a GPU shares the main memory."""
        sizes: dict[int, float] = {}
        try:
            for device in self._devices:
                for one in self._ask("nvmlDeviceGetComputeRunningProcesses", device):
                    sizes[one.pid] = sizes.get(one.pid, 0.0) + float(one.usedGpuMemory or 0)
            self._memory("used")
        except ValueMissing:
            yield measure("gpu_memory_used_bytes", "bytes", partial(_sum_of, sizes))
        for pid, size in sizes.items():
            yield Reading(name=f"gpu_memory_used_bytes.{pid}", value=size, unit="bytes")

    def _of_device(self, index: int, device: Any) -> Iterator[Reading]:
        name = f"gpu{index}"
        yield measure(f"power_w.{name}", "W", partial(self._power_w, device))
        yield measure(f"temperature_c.{name}", "degC", partial(self._celsius, device))

    def _power_w(self, device: Any) -> float:
        return float(self._ask("nvmlDeviceGetPowerUsage", device)) * _W_PER_MW

    def _celsius(self, device: Any) -> float:
        return float(self._ask("nvmlDeviceGetTemperature", device, _GPU_SENSOR))


def _sum_of(sizes: dict[int, float]) -> float:
    if not sizes:
        raise ValueMissing("NVML names no process with GPU memory")
    return sum(sizes.values())
