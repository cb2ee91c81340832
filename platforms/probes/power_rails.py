"""Read a Jetson's INA3221 chips: voltage times current of each rail."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from platforms.probes.discovery import Hwmon
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree, ValueMissing

CHIP: Final = "ina3221"
CHANNELS: Final = (1, 2, 3)  # channel 7 is the chip's own sum, which means nothing here
NOT_CONNECTED: Final = "NC"
# Rails that carry everything, and one that feeds what other rails measure again.
TOTAL_RAILS: Final = ("VDD_IN", "VIN")
NOT_SUMMED: Final = frozenset({"VIN_SYS_5V0"})
_W_PER_MV_MA: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerRail:
    """Hold the two files of one rail."""

    voltage: SystemFile
    current: SystemFile

    def power_w(self) -> float:
        """Return the power.

        Raises:
            Missing: voltage or current cannot be read.
        """
        return self.voltage.number() * self.current.number() * _W_PER_MV_MA


class PowerSource:
    """Read each rail, and what they make together by the board's rule."""

    def __init__(self, tree: Tree, hwmon: Hwmon) -> None:
        self._tree, self._hwmon = tree, hwmon
        self._folders: tuple[str, ...] | None = None
        self._rails: Mapping[str, PowerRail] = {}

    def readings(self) -> Iterator[Reading]:
        """Return the total and each rail."""
        folders = self._hwmon.chips().get(CHIP, ())
        if folders != self._folders or not self._rails:
            self._folders, self._rails = folders, self._find(folders)
        each = {
            label: measure(f"power_w.{label}", "W", rail.power_w)
            for label, rail in self._rails.items()
        }
        yield total_power(each)
        yield from each.values()

    def _find(self, folders: Sequence[str]) -> dict[str, PowerRail]:
        rails: dict[str, PowerRail] = {}
        for folder in folders:
            for channel in CHANNELS:
                label = self._label(f"{folder}/in{channel}_label")
                if label not in ("", NOT_CONNECTED):
                    rails[label] = PowerRail(
                        voltage=self._tree.file(f"{folder}/in{channel}_input"),
                        current=self._tree.file(f"{folder}/curr{channel}_input"),
                    )
        return rails

    def _label(self, path: str) -> str:
        try:
            return self._tree.text(path)
        except ValueMissing:
            return ""


def total_power(rails: Mapping[str, Reading]) -> Reading:
    """Return the rail that carries everything, or else the sum; a sum lacks no part."""
    if not rails:
        return lacking("power_w", "W", f"no {CHIP} below {Hwmon.FOLDER} has a rail")
    whole = next((rails[label] for label in TOTAL_RAILS if label in rails), None)
    parts = [
        reading
        for label, reading in rails.items()
        if (whole is None and label not in NOT_SUMMED) or reading is whole
    ]
    for part in parts:
        if part.value is None:
            return Reading(name="power_w", value=None, unit="W", reason=part.reason)
    total = sum(part.value for part in parts if part.value is not None)
    return Reading(name="power_w", value=total, unit="W")
