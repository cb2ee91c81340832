"""Read the fan's speed and how it is driven."""

from collections.abc import Iterator, Sequence
from typing import Final

from platforms.probes.discovery import Hwmon
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree

SPEED_FILES: Final = ("fan1_input", "rpm")  # a Jetson's tachometer says rpm
DRIVE_FILES: Final = ("pwm1",)
_FULL_DRIVE: Final = 255.0


class FanSource:
    """Read the first fan of the board."""

    def __init__(self, tree: Tree, hwmon: Hwmon) -> None:
        self._tree, self._hwmon = tree, hwmon
        self._chips: dict[str, tuple[str, ...]] | None = None
        self._speed: SystemFile | None = None
        self._drive: SystemFile | None = None

    def readings(self) -> Iterator[Reading]:
        """Return revolutions per minute and the part of full drive."""
        chips = self._hwmon.chips()
        if chips is not self._chips:
            self._chips = chips
            self._speed, self._drive = self._first(SPEED_FILES), self._first(DRIVE_FILES)
        yield _measured("fan_rpm", "rpm", self._speed, 1.0)
        yield _measured("fan_drive_ratio", "ratio", self._drive, 1 / _FULL_DRIVE)

    def _first(self, names: Sequence[str]) -> SystemFile | None:
        paths = (
            f"{folder}/{name}"
            for folders in self._hwmon.chips().values()
            for folder in folders
            for name in names
        )
        found = next((path for path in paths if self._tree.exists(path)), None)
        return None if found is None else self._tree.file(found)


def _measured(name: str, unit: str, file: SystemFile | None, factor: float) -> Reading:
    if file is None:
        return lacking(name, unit, f"no chip below {Hwmon.FOLDER} has a fan")
    return measure(name, unit, lambda: file.number() * factor)
