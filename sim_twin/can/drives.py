"""Build the emulated drives that a robot file asks for, by protocol."""

from collections.abc import Callable, Mapping
from typing import Final

from drivers.canopen import EDS_PATH
from drivers.odrive import EMULATED_ENDPOINTS
from sim_twin.can.cia402.drive import WheelDrive
from sim_twin.can.emulated_drive import EmulatedDrive, MotorMounting
from sim_twin.can.odrive.axis import ODriveAxis
from vla_deploy.robots.devices import CanBus, Drive

DRIVES: Final[Mapping[str, Callable[..., EmulatedDrive]]] = {
    "cia402": WheelDrive,
    "odrive": ODriveAxis,
}


def robot_drives(wiring: CanBus) -> tuple[EmulatedDrive, ...]:
    """Return the drives of a robot with its encoders and gears, and its EDS or endpoint file.

    Raises:
        WrongDevice: the file is not what it should be.
    """
    files = {
        "cia402": wiring.eds_path or EDS_PATH,
        "odrive": wiring.endpoints_path or EMULATED_ENDPOINTS,
    }
    kind, path = DRIVES[wiring.protocol], files[wiring.protocol]
    return tuple(kind(drive.node_id, _mounting(drive), path) for drive in wiring.drives)


def _mounting(drive: Drive) -> MotorMounting:
    return MotorMounting(
        sign=drive.sign, counts_per_rev=drive.counts_per_rev, gear_ratio=drive.gear_ratio
    )
