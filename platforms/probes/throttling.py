"""Read how often a Jetson's SOCTHERM throttled for its supply.

OC1 is under-voltage and OC2 average over-current: faults of the supply. OC3, instantaneous
over-current, rises under ordinary heavy load.
"""

from collections.abc import Iterator
from typing import Final

from platforms.probes.discovery import Hwmon
from platforms.probes.reading import Reading, lacking, measure
from platforms.tree import SystemFile, Tree, ValueMissing

CHIP: Final = "soctherm_oc"
COUNTERS: Final = ("oc1", "oc2", "oc3")


class ThrottleSource:
    """Count since boot, as the kernel does, and since the last reading."""

    def __init__(self, tree: Tree, hwmon: Hwmon) -> None:
        self._tree, self._hwmon = tree, hwmon
        self._last: dict[str, float] = {}
        list(self.readings())  # what the first reading compares with

    def readings(self) -> Iterator[Reading]:
        """Return `throttle_count.<oc>` since boot, `throttle_events.<oc>` since the last time."""
        files = self._files()
        for name in COUNTERS:
            if name not in files:
                because = f"no {CHIP} below {Hwmon.FOLDER}"
                count = lacking(f"throttle_count.{name}", "events", because)
            else:
                count = measure(f"throttle_count.{name}", "events", files[name].number)
            yield count
            yield self._events(name, count)

    def _files(self) -> dict[str, SystemFile]:
        folders = self._hwmon.chips().get(CHIP, ())
        return {
            name: self._tree.file(f"{folders[0]}/{name}_event_cnt")
            for name in (COUNTERS if folders else ())
        }

    def _events(self, name: str, count: Reading) -> Reading:
        event = f"throttle_events.{name}"
        if count.value is None:
            return Reading(name=event, value=None, unit="events", reason=count.reason)
        last, self._last[name] = self._last.get(name), count.value
        return measure(event, "events", lambda: _rise(last, count.value or 0.0))


def _rise(last: float | None, now: float) -> float:
    if last is None:
        raise ValueMissing("this is the first look at the counter, and it takes two")
    if now < last:
        raise ValueMissing(f"the counter went back from {last:g} to {now:g}")
    return now - last
