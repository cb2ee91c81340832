"""Keep the topic `battery`: what is measured, what it means."""

import logging
from concurrent.futures import Executor
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.robots.battery_settings import BatterySettings, BatterySource
from vla_deploy.supervisor.battery.charge import (
    BatteryLevel,
    LevelState,
    estimated_charge,
    judged,
)
from vla_deploy.supervisor.battery.measuring import (
    BatteryMeter,
    BatteryReading,
    GaugeMeter,
    ServoMeter,
)

PERIOD_NS: Final = NS_PER_S // 2
_DIGITS: Final = 3
_REASON_CHARACTERS: Final = 200
_log = logging.getLogger(__name__)


class BatteryKeeper:
    """Measure twice a second, judge and publish; `step` never waits."""

    def __init__(
        self, settings: BatterySettings, meter: BatteryMeter, space: SharedSpace, clock: Clock
    ) -> None:
        self._settings = settings
        self._meter = meter
        self._clock = clock
        self._cell = space.cell_writer(topics.BATTERY)
        self._state = LevelState()
        self._due_ns = clock.now_ns()

    def step(self) -> None:
        """Publish when it is due."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + PERIOD_NS
        reading = self._meter.measure()
        charge_ratio, is_estimate = reading.charge_ratio, False
        if charge_ratio is None and reading.voltage_v is not None:
            charge_ratio = estimated_charge(reading.voltage_v, self._settings)
            is_estimate = charge_ratio is not None
        self._judge(charge_ratio, now_ns)
        self._cell.put_document(self._document(reading, charge_ratio, is_estimate))

    def close(self) -> None:
        """Release what measures, and the topic."""
        self._meter.close()
        self._cell.close()

    def _judge(self, charge_ratio: float | None, now_ns: int) -> None:
        before = self._state.level
        self._state = judged(self._state, charge_ratio, self._settings, now_ns)
        level = self._state.level
        if level > before:
            _log.warning("battery: %s at %.0f %%", level.name.lower(), 100 * (charge_ratio or 0.0))
        elif level < before:
            _log.info("battery: %s again", level.name.lower())

    def _document(
        self, reading: BatteryReading, charge_ratio: float | None, is_estimate: bool
    ) -> BatteryDocument:
        known = {"charge_ratio"} if charge_ratio is not None else set()
        return {
            "source": self._settings.source.value,
            "stamp_ns": reading.stamp_ns,
            "voltage_v": _rounded(reading.voltage_v),
            "charge_ratio": _rounded(charge_ratio),
            "is_estimate": is_estimate,
            "current_a": _rounded(reading.current_a),
            "is_charging": reading.is_charging,
            "low": self._state.level >= BatteryLevel.LOW,
            "critical": self._state.level >= BatteryLevel.CRITICAL,
            "missing": {
                key: why[:_REASON_CHARACTERS]
                for key, why in reading.missing.items()
                if key not in known
            },
        }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, _DIGITS)


def open_battery(
    settings: BatterySettings, space: SharedSpace, clock: Clock, root: Path, executor: Executor
) -> BatteryKeeper:
    """Return the keeper of a robot's battery; `root` is where system files are, `/` on a robot.

    A gauge is read in `executor`.
    """
    if settings.source is BatterySource.SERVOS:
        meter: BatteryMeter = ServoMeter(space, clock)
    else:
        meter = GaugeMeter(root, settings.supply, clock, executor)
    return BatteryKeeper(settings, meter, space, clock)
