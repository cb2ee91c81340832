"""Set a Jetson's power mode by its name, through nvpmodel, and read it back.

Only root may: where the service for that is installed, it is asked to.
"""

import re
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from platforms.errors import ProfileError
from platforms.power_service import SOCKET, ask_for_mode
from platforms.probes.power_mode import CONFIGURATION, PowerModes, read_power_modes
from platforms.tree import Tree, ValueMissing

NVPMODEL: Final = ("/usr/sbin/nvpmodel",)
_TIMEOUT_S: Final = 10.0
_SECTION: Final = re.compile(r"<\s*POWER_MODEL\s+ID=(\d+)[^>]*>([^<]*)")
# Which units have power is settled at boot, by lines such as "TPC_POWER_GATING TPC_PG_MASK 252".
_MASK: Final = re.compile(r"^\s*(\w+)\s+(\w*PG_MASK\w*)\s+(\S+)", re.MULTILINE)
_PREFIX: Final = "MODE_"


class PowerSwitch:
    """Know the modes of the board below `root`; `command` sets one where no service does."""

    def __init__(self, root: Path = Path("/"), command: Sequence[str] = NVPMODEL) -> None:
        self._tree = Tree(root)
        self._command = tuple(command)
        self._service = root / SOCKET

    def check(self, name: str) -> None:
        """Refuse a mode that the board does not have, or that it takes a reboot to enter.

        Raises:
            ProfileError: says which, and what to do.
        """
        if not name:
            return
        modes = read_power_modes(self._tree)
        wanted = _find(modes, name)
        if wanted is None:
            known = ", ".join(modes.names.values()) or modes.reason
            raise ProfileError((f"power_mode: expected one of this board ({known}), got {name!r}",))
        if modes.current is None:
            raise ProfileError((f"power_mode: {name} cannot be read back: {modes.reason}",))
        masks = self._masks()
        if masks.get(wanted) != masks.get(modes.current):
            raise ProfileError(
                (
                    f"power_mode: {modes.current_name} -> {modes.names[wanted]} needs a reboot, "
                    f"for other units get power: nvpmodel -m {wanted}, reboot, use it then",
                )
            )

    def current(self) -> str:
        """Return the name of the mode that is set; empty where there is none."""
        return read_power_modes(self._tree).current_name or ""

    def set(self, name: str) -> str:
        """Set a mode unless it is set already, and return why that failed, empty on success."""
        modes = read_power_modes(self._tree)
        wanted = _find(modes, name)
        if not name or wanted == modes.current is not None:
            return ""
        if wanted is None:
            return f"power mode {name}: this board has none of that name"
        set_mode = self._ask if self._service.exists() else self._run
        try:
            said = set_mode(wanted)
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"power mode {name}: {error}"
        now = read_power_modes(self._tree)
        if now.current == wanted:
            return ""
        return f"power mode {name}: it is {now.current_name} after setting it{said}"

    def _ask(self, wanted: int) -> str:
        answer = ask_for_mode(self._service, wanted, _TIMEOUT_S)
        return f"; vla-deploy-power.service said: {answer or 'nothing'}"

    def _run(self, wanted: int) -> str:
        done = subprocess.run(
            [*self._command, "-m", str(wanted)],
            stdin=subprocess.DEVNULL,  # it asks whether to reboot
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
        words = (done.stderr or done.stdout).strip().splitlines()
        return f"; nvpmodel said: {words[-1]}" if words else ""

    def _masks(self) -> Mapping[int, tuple[tuple[str, ...], ...]]:
        """Return what each mode says about the units that get power."""
        try:
            text = self._tree.text(CONFIGURATION)
        except ValueMissing:
            return {}
        return {
            int(number): tuple(sorted(_MASK.findall(body)))
            for number, body in _SECTION.findall(text)
        }


def _find(modes: PowerModes, name: str) -> int | None:
    """Return a mode's id; some releases write MODE_15W for what others call 15W."""
    for number, known in modes.names.items():
        if known.removeprefix(_PREFIX) == name.removeprefix(_PREFIX):
            return number
    return None
