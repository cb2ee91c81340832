"""Read the thermal zones. A zone whose unit sleeps fails with EAGAIN; another may be empty."""

from collections.abc import Iterable, Iterator
from functools import partial
from typing import Final

from platforms.probes.discovery import Discovery
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree, ValueMissing

ZONES: Final = "/sys/class/thermal"
TEMPERATURE: Final = "temperature_c"
# What a sensor cannot truly measure: a Tegra zone that is off may say -256 degrees.
COLDEST_C: Final = -60.0
HOTTEST_C: Final = 200.0


class ThermalSource:
    """Read each thermal zone."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        self._zones = Discovery(tree, ZONES, self._find)

    def readings(self) -> Iterator[Reading]:
        """Return a temperature per zone, named by the zone's type."""
        for name, file in self._zones.current().items():
            yield measure(f"{TEMPERATURE}.{name}", "degC", partial(_celsius, file))

    def _find(self, names: tuple[str, ...]) -> dict[str, SystemFile]:
        zones: dict[str, SystemFile] = {}
        for folder in names:
            if folder.startswith("thermal_zone"):
                name = self._type(folder)
                name = f"{name}_{folder.removeprefix('thermal_zone')}" if name in zones else name
                zones[name] = self._tree.file(f"{ZONES}/{folder}/temp")
        return zones

    def _type(self, folder: str) -> str:
        try:
            return self._tree.text(f"{ZONES}/{folder}/type") or folder
        except ValueMissing:
            return folder


def hottest(readings: Iterable[Reading]) -> Reading:
    """Return the highest of all temperatures that could be read."""
    zones = [one for one in readings if one.name.startswith(f"{TEMPERATURE}.")]
    known = [one.value for one in zones if one.value is not None]
    if known:
        return Reading(name=TEMPERATURE, value=max(known), unit="degC")
    because = f"none of {len(zones)} zones can be read" if zones else f"{ZONES} has no zone"
    return lacking(TEMPERATURE, "degC", because)


def _celsius(file: SystemFile) -> float:
    value = file.number() / 1000
    if not COLDEST_C <= value <= HOTTEST_C:
        raise ValueMissing(f"{file} says {value:g} degC, which its sensor cannot measure")
    return value
