"""Turn snapshots into what the budgets' lines speak of: megabytes, cores, watts, degrees."""

from collections import deque
from collections.abc import Mapping
from typing import Final

from drivers.clock import NS_PER_S
from platforms.probes import Reading
from vla_deploy.supervisor.budgets.judge import Measurement
from vla_deploy.supervisor.budgets.lines import TOTAL
from vla_deploy.supervisor.budgets.sampler import UsageSnapshot

Measurements = dict[tuple[str, str], Measurement]

CPU_WINDOW_S: Final = 2.0
_MB: Final = 1_000_000
# The twin stands for the hardware: on a robot it is not there.
OUTSIDE_THE_TOTAL: Final = frozenset({"twin"})
_FROM_READINGS: Final[Mapping[str, tuple[str, float]]] = {
    "power_w": ("power_w", 1.0),
    "temperature_c": ("temperature_c", 1.0),
    "gpu_memory_mb": ("gpu_memory_used_bytes", 1.0 / _MB),
    "disk_free_mb": ("disk_free_bytes", 1.0 / _MB),
}


class Measurer:
    """Keep the snapshots of the last moments: CPU use is a mean over them."""

    def __init__(self) -> None:
        self._recent: deque[UsageSnapshot] = deque()

    def measure(self, snapshot: UsageSnapshot, processes: frozenset[str]) -> Measurements:
        """Return a measurement for every line that a profile may declare."""
        self._remember(snapshot)
        found: Measurements = {}
        for process in sorted(processes):
            found["memory_mb", process] = self._of(process, self._memory_mb(process))
            found["cpu_ratio", process] = self._of(process, self._cpu_ratio(process))
        counted = [name for name in snapshot.usages if name not in OUTSIDE_THE_TOTAL]
        found["memory_mb", TOTAL] = _sum([self._memory_mb(name) for name in counted])
        found["cpu_ratio", TOTAL] = _sum([self._cpu_ratio(name) for name in counted])
        for metric, (name, scale) in _FROM_READINGS.items():
            found[metric, TOTAL] = _scaled(snapshot.readings.get(name), name, scale)
        return found

    def _remember(self, snapshot: UsageSnapshot) -> None:
        self._recent.append(snapshot)
        oldest_ns = snapshot.stamp_ns - round(CPU_WINDOW_S * NS_PER_S)
        while len(self._recent) > 2 and self._recent[1].stamp_ns <= oldest_ns:
            self._recent.popleft()

    def _of(self, process: str, value: float | None) -> Measurement:
        if process not in self._recent[-1].pids:
            return Measurement(value=None, reason="it does not run", ended=True)
        if value is None:
            return Measurement(value=None, reason="it was not measured yet")
        return Measurement(value=value)

    def _memory_mb(self, process: str) -> float | None:
        """Return what a process holds; on a Jetson its GPU memory is part of the same memory."""
        newest = self._recent[-1]
        usage = newest.usages.get(process)
        if usage is None:
            return None
        on_gpu = newest.readings.get(f"gpu_memory_used_bytes.{newest.pids.get(process)}")
        gpu_bytes = on_gpu.value if on_gpu is not None and on_gpu.value is not None else 0.0
        return usage.memory_mb + gpu_bytes / _MB

    def _cpu_ratio(self, process: str) -> float | None:
        newest = self._recent[-1]
        oldest = next((one for one in self._recent if process in one.usages), newest)
        # A twin's time may be slower or faster than the wall's. What is done by either of them is
        # no more per second than on a robot, where both are one.
        elapsed_ns = max(newest.stamp_ns - oldest.stamp_ns, newest.wall_ns - oldest.wall_ns)
        elapsed_s = elapsed_ns / NS_PER_S
        if process not in newest.usages or elapsed_s <= 0.0:
            return None
        return (newest.usages[process].cpu_s - oldest.usages[process].cpu_s) / elapsed_s


def _sum(values: list[float | None]) -> Measurement:
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return Measurement(value=None, reason="not every process was measured yet")
    return Measurement(value=sum(known))


def _scaled(reading: Reading | None, name: str, scale: float) -> Measurement:
    if reading is None:
        return Measurement(value=None, reason=f"no probe reads {name}")
    if reading.value is None:
        return Measurement(value=None, reason=reading.reason)
    return Measurement(value=reading.value * scale)
