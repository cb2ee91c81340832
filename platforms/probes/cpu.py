"""Read how busy the processors are: /proc/stat, cpufreq, and pressure where the kernel has it."""

from collections.abc import Iterator
from functools import partial

from platforms.probes.discovery import Discovery
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree, ValueMissing

CPUFREQ = "/sys/devices/system/cpu/cpufreq"
PRESSURES = ("cpu", "memory", "io")
_IDLE, _IOWAIT, _STEAL = 3, 4, 7
_MOST_DIGITS = 20  # of a 64-bit counter


class CpuSource:
    """Compare the kernel's counters with those of the last reading."""

    def __init__(self, tree: Tree) -> None:
        self._stat = tree.file("/proc/stat")
        self._last: tuple[int, int] | None = None
        self._cores = 0
        measure("", "", self._busy_ratio)  # the counters that the first reading compares with

    def readings(self) -> Iterator[Reading]:
        """Return the busy part of all cores together, and how many cores that is."""
        busy = measure("cpu_ratio", "ratio", self._busy_ratio)
        yield busy
        if busy.value is None:
            yield Reading(name="cpu_busy_cores", value=None, unit="cores", reason=busy.reason)
        else:
            yield Reading(name="cpu_busy_cores", value=busy.value * self._cores, unit="cores")

    def _busy_ratio(self) -> float:
        busy, total = self._counters()
        last, self._last = self._last, (busy, total)
        if last is None:
            raise ValueMissing("this is the first look at /proc/stat, and it takes two")
        if total <= last[1] or busy < last[0]:
            raise ValueMissing("the counters in /proc/stat have not moved on since the last look")
        return min((busy - last[0]) / (total - last[1]), 1.0)

    def _counters(self) -> tuple[int, int]:
        lines = self._stat.text().splitlines()
        try:
            ticks = [int(word[:_MOST_DIGITS]) for word in lines[0].split()[1 : _STEAL + 1]]
            idle = ticks[_IDLE] + ticks[_IOWAIT]
        except (ValueError, IndexError) as error:
            raise ValueMissing("/proc/stat does not begin with a line of counters") from error
        self._cores = sum(line.startswith("cpu") for line in lines) - 1
        return sum(ticks) - idle, sum(ticks)


class CpuFrequencySource:
    """Read the present clock of each group of cores."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        self._policies = Discovery(tree, CPUFREQ, self._find)

    def readings(self) -> Iterator[Reading]:
        """Return a clock per policy, and that of the fastest."""
        each = [
            measure(f"cpu_frequency_hz.{name}", "Hz", partial(_hertz, file))
            for name, file in self._policies.current().items()
        ]
        known = [reading.value for reading in each if reading.value is not None]
        if known:
            yield Reading(name="cpu_frequency_hz", value=max(known), unit="Hz")
        else:
            yield lacking("cpu_frequency_hz", "Hz", f"no policy below {CPUFREQ} tells its clock")
        yield from each

    def _find(self, names: tuple[str, ...]) -> dict[str, SystemFile]:
        return {
            name: self._tree.file(f"{CPUFREQ}/{name}/scaling_cur_freq")
            for name in names
            if name.startswith("policy")
        }


class PressureSource:
    """Read which part of the last 10 s something had to wait for a resource."""

    def __init__(self, tree: Tree) -> None:
        self._files = {what: tree.file(f"/proc/pressure/{what}") for what in PRESSURES}

    def readings(self) -> Iterator[Reading]:
        """Return the pressure on processors, memory and disks."""
        for what, file in self._files.items():
            yield measure(f"psi_{what}_ratio", "ratio", partial(_some_ratio, file))


def _hertz(file: SystemFile) -> float:
    return file.number() * 1000  # the kernel says kHz


def _some_ratio(file: SystemFile) -> float:
    for word in file.text().partition("\n")[0].split():
        key, _, value = word.partition("=")
        if key == "avg10":
            try:
                return float(value) / 100
            except ValueError as error:
                raise ValueMissing(f"{file} holds avg10={value!r}, expected a number") from error
    raise ValueMissing(f"{file} tells no avg10")
