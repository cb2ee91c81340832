"""Read a battery's gauge as the kernel shows it: /sys/class/power_supply.

Documentation/ABI/testing/sysfs-class-power: voltages in µV, currents in µA, powers in µW; drivers
differ in the sign of the current, so it is taken from `status`.
"""

from collections.abc import Iterator
from typing import Final

from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import Tree, ValueMissing

FOLDER: Final = "/sys/class/power_supply"
CHARGE: Final = "battery_charge_ratio"
VOLTAGE: Final = "battery_voltage_v"
CURRENT: Final = "battery_current_a"
CHARGING: Final = "battery_charging"
_MICRO: Final = 1e-6
_CHARGING: Final = "Charging"
_IDLE: Final = ("Full", "Not charging")
_DISCHARGING: Final = "Discharging"
_FULL_PERCENT: Final = 100.0
# Where a gauge has no percentage: what is in it, and what goes in.
_PARTS: Final = (("energy_now", "energy_full"), ("charge_now", "charge_full"))


class PowerSupplySource:
    """Read the battery of that name, or the first that is none of a mouse or a headset."""

    def __init__(self, tree: Tree, name: str = "") -> None:
        self._tree, self._name = tree, name

    def readings(self) -> Iterator[Reading]:
        """Return charge, voltage, current (positive into the battery) and 1 while it charges."""
        try:
            folder = f"{FOLDER}/{self._name or self._first()}"
        except ValueMissing as missing:
            for name, unit in _UNITS.items():
                yield lacking(name, unit, str(missing))
            return
        yield measure(CHARGE, _UNITS[CHARGE], lambda: self._charge_ratio(folder))
        yield measure(VOLTAGE, _UNITS[VOLTAGE], lambda: self._voltage_v(folder))
        yield measure(CURRENT, _UNITS[CURRENT], lambda: self._current_a(folder))
        yield measure(CHARGING, _UNITS[CHARGING], lambda: float(self._status(folder) == _CHARGING))

    def close(self) -> None:
        """Give all handles back."""
        self._tree.close()

    def _first(self) -> str:
        names = self._tree.names(FOLDER)
        for name in names:
            if self._is("type", name, "Battery") and not self._is("scope", name, "Device"):
                return name
        raise ValueMissing(f"no battery is in {FOLDER}, which has: {', '.join(names) or 'nothing'}")

    def _is(self, file: str, name: str, value: str) -> bool:
        try:
            return self._tree.text(f"{FOLDER}/{name}/{file}") == value
        except ValueMissing:
            return False

    def _number(self, folder: str, name: str) -> float:
        return self._tree.file(f"{folder}/{name}").number()

    def _charge_ratio(self, folder: str) -> float:
        path = f"{folder}/capacity"
        try:
            percent = self._tree.file(path).number()
        except ValueMissing as missing:
            return self._from_parts(folder, missing)
        return _ratio(percent / _FULL_PERCENT, f"{path} holds {percent:g}")

    def _from_parts(self, folder: str, missing: ValueMissing) -> float:
        for now, full in _PARTS:
            try:
                held, most = self._number(folder, now), self._number(folder, full)
            except ValueMissing:
                continue
            if most > 0.0:
                return _ratio(held / most, f"{folder}/{now} and {full} hold {held:g} and {most:g}")
        raise missing

    def _voltage_v(self, folder: str) -> float:
        return self._number(folder, "voltage_now") * _MICRO

    def _current_a(self, folder: str) -> float:
        status = self._status(folder)
        try:
            size_a = abs(self._number(folder, "current_now")) * _MICRO
        except ValueMissing as missing:
            size_a = self._current_of_power_a(folder, missing)
        return -size_a if status == _DISCHARGING else size_a

    def _current_of_power_a(self, folder: str, missing: ValueMissing) -> float:
        try:
            power_w = abs(self._number(folder, "power_now")) * _MICRO
        except ValueMissing:
            raise missing from None
        volts = self._voltage_v(folder)
        if not volts > 0.0:
            raise missing
        return power_w / volts

    def _status(self, folder: str) -> str:
        path = f"{folder}/status"
        status = self._tree.file(path).text()
        known = (_CHARGING, _DISCHARGING, *_IDLE)
        if status not in known:
            raise ValueMissing(f"{path} holds {status[:24]!r}, expected one of {', '.join(known)}")
        return status


_UNITS: Final = {CHARGE: "ratio", VOLTAGE: "V", CURRENT: "A", CHARGING: ""}


def _ratio(value: float, what: str) -> float:
    if not 0.0 <= value <= 1.0:
        raise ValueMissing(f"{what}, expected 0 to {_FULL_PERCENT:g} %")
    return value
