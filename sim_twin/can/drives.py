"""Name the emulated drive of each protocol that a robot file may ask for."""

from collections.abc import Callable, Mapping
from typing import Final

from sim_twin.can.drive import WheelDrive
from sim_twin.can.emulated_drive import EmulatedDrive
from sim_twin.can.odrive import ODriveAxis

DRIVES: Final[Mapping[str, Callable[..., EmulatedDrive]]] = {
    "cia402": WheelDrive,
    "odrive": ODriveAxis,
}
