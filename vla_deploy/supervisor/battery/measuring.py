"""Measure the battery by what the robot file names: the kernel's gauge, or the servos."""

import logging
import statistics
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from platforms.probes.battery import CHARGE, CHARGING, CURRENT, VOLTAGE, PowerSupplySource
from platforms.probes.reading import Reading
from platforms.tree import Tree
from vla_deploy.ipc import SharedSpace, topics

_log = logging.getLogger(__name__)
SILENT_NS: Final = 5 * NS_PER_S
"""A gauge that has not answered for so long has failed."""
WINDOW_NS: Final = 30 * NS_PER_S
"""Motors pull the voltage down for moments: the mean of so long stands for it."""
_STATUS_AGE_S: Final = 2.0
_VOLTAGE_ONLY: Final = "servos measure the voltage only"
_SILENT: Final = "missing, because the gauge has not answered for {seconds:.0f} s"


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryReading:
    """Hold what was measured at `stamp_ns`; `missing` say by key why something is missing."""

    stamp_ns: int
    voltage_v: float | None = None
    charge_ratio: float | None = None
    current_a: float | None = None
    is_charging: bool | None = None
    missing: Mapping[str, str] = field(default_factory=dict)


class BatteryMeter(Protocol):
    """Measure the battery without waiting."""

    def measure(self) -> BatteryReading:
        """Return the newest reading."""
        ...

    def close(self) -> None:
        """Release what is open."""
        ...


class GaugeMeter:
    """Read the kernel's gauge in an executor, since a gauge on a slow bus takes its time."""

    def __init__(self, root: Path, supply: str, clock: Clock, executor: Executor) -> None:
        self._source = PowerSupplySource(Tree(root), supply)
        self._clock = clock
        self._executor = executor
        self._asked: Future[BatteryReading] | None = None
        self._asked_ns = clock.now_ns()
        self._newest: BatteryReading | None = None

    def measure(self) -> BatteryReading:
        """Return the newest reading, and ask for the next one."""
        now_ns = self._clock.now_ns()
        self._take(now_ns)
        if self._asked is None:
            self._asked_ns = now_ns
            self._asked = self._executor.submit(self._read)
            self._take(now_ns)  # an executor may do it at once
        newest = self._newest
        heard_ns = self._asked_ns if newest is None else newest.stamp_ns
        if newest is None or now_ns - newest.stamp_ns > SILENT_NS:
            why = _SILENT.format(seconds=(now_ns - heard_ns) / NS_PER_S)
            return BatteryReading(stamp_ns=now_ns, missing=dict.fromkeys(_KEYS.values(), why))
        return newest

    def _answer(self, asked: "Future[BatteryReading]", now_ns: int) -> BatteryReading:
        """Return what came; a fault of the reading itself must not end the supervisor."""
        error = asked.exception()
        if error is None:
            return asked.result()
        _log.error("the battery's gauge could not be read", exc_info=error)
        why = f"missing, because reading the gauge failed: {error!r}"
        return BatteryReading(stamp_ns=now_ns, missing=dict.fromkeys(_KEYS.values(), why))

    def close(self) -> None:
        """Ask no more; a gauge that hangs is left behind."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _take(self, now_ns: int) -> None:
        if self._asked is not None and self._asked.done():
            self._newest, self._asked = self._answer(self._asked, now_ns), None

    def _read(self) -> BatteryReading:
        readings = {one.name: one for one in self._source.readings()}
        return reading_of(readings, self._clock.now_ns())


class ServoMeter:
    """Take the supply voltage that servos measure, as control publishes it."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._status = space.cell_reader(topics.CONTROL_STATUS)
        self._clock = clock
        self._kept: deque[tuple[int, float]] = deque()

    def measure(self) -> BatteryReading:
        """Return the mean voltage of the last half minute."""
        now_ns = self._clock.now_ns()
        while self._kept and now_ns - self._kept[0][0] > WINDOW_NS:
            self._kept.popleft()
        missing = dict.fromkeys(("charge_ratio", "current_a", "is_charging"), _VOLTAGE_ONLY)
        volts = self._volts()
        if volts is None:
            why = "missing, because control tells no voltage of the servos"
            return BatteryReading(stamp_ns=now_ns, missing={**missing, "voltage_v": why})
        self._kept.append((now_ns, volts))
        mean_v = statistics.fmean(volts for _, volts in self._kept)
        return BatteryReading(stamp_ns=now_ns, voltage_v=mean_v, missing=missing)

    def close(self) -> None:
        """Unmap the topic."""
        self._status.close()

    def _volts(self) -> float | None:
        sample = self._status.latest()
        if sample is None or sample.age_s(self._clock.now_ns()) > _STATUS_AGE_S:
            return None
        told = sample.document().get("joints", {}).get("voltage_v", ())
        measured = [volts for volts in told if volts is not None]
        return statistics.median(measured) if measured else None


_KEYS: Final[Mapping[str, str]] = {
    VOLTAGE: "voltage_v",
    CHARGE: "charge_ratio",
    CURRENT: "current_a",
    CHARGING: "is_charging",
}


def reading_of(readings: Mapping[str, Reading], stamp_ns: int) -> BatteryReading:
    """Return what a gauge has told as one reading."""
    charging = readings[CHARGING].value
    return BatteryReading(
        stamp_ns=stamp_ns,
        voltage_v=readings[VOLTAGE].value,
        charge_ratio=readings[CHARGE].value,
        current_a=readings[CURRENT].value,
        is_charging=None if charging is None else bool(charging),
        missing={
            key: readings[name].reason
            for name, key in _KEYS.items()
            if readings[name].value is None
        },
    )
