"""Read a Jetson's power modes from nvpmodel's own files: ids differ by board and by release."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from platforms.probes.reading import Reading, measure
from platforms.tree import Tree, ValueMissing

CONFIGURATION: Final = "/etc/nvpmodel.conf"
STATUS: Final = "/var/lib/nvpmodel/status"
_MODE: Final = re.compile(r"^\s*<\s*POWER_MODEL\s+ID=(\d{1,4})\s+NAME=(\S+?)\s*>", re.MULTILINE)
_DEFAULT: Final = re.compile(r"^\s*<\s*PM_CONFIG\s+DEFAULT=(\d{1,4})\s*>", re.MULTILINE)
_CURRENT: Final = re.compile(r"\bpmode:\s*(\d{1,9})\b")


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerModes:
    """Hold the names of the modes by id, and which is set; None and a reason where unknown."""

    names: Mapping[int, str]
    default: int | None
    current: int | None
    reason: str

    @property
    def current_name(self) -> str | None:
        """Return the name of the mode that is set."""
        return None if self.current is None else self.names.get(self.current, str(self.current))


class PowerModeSource:
    """Read the mode that is set back from where nvpmodel keeps it."""

    def __init__(self, tree: Tree) -> None:
        self._status = tree.file(STATUS)

    def readings(self) -> Iterator[Reading]:
        """Return the id of the mode."""
        yield measure("power_mode_id", "id", lambda: float(_current(self._status.text())))


def read_power_modes(tree: Tree) -> PowerModes:
    """Return what modes the board has and which one is set."""
    reasons = []
    try:
        text = tree.text(CONFIGURATION)
    except ValueMissing as missing:
        text = ""
        reasons.append(str(missing))
    names = {int(number): name for number, name in _MODE.findall(text)}
    if text and not names:
        reasons.append(f"{CONFIGURATION} declares no POWER_MODEL")
    default = _DEFAULT.search(text)
    try:
        current = _current(tree.text(STATUS))
    except ValueMissing as missing:
        current = None
        reasons.append(str(missing))
    return PowerModes(
        names=names,
        default=int(default.group(1)) if default else None,
        current=current,
        reason="; ".join(reasons),
    )


def _current(status: str) -> int:
    found = _CURRENT.search(status)
    if found is None:
        raise ValueMissing(f"{STATUS} names no pmode")
    return int(found.group(1))
