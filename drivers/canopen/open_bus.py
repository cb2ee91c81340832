"""Open the CAN bus that the robot file names: a SocketCAN interface, or the twin's hub."""

import can

from drivers.can_hub import HubBus
from drivers.errors import DeviceMissing


def open_can_bus(channel: str, bitrate: int = 1_000_000) -> can.BusABC:
    """Open `channel`: a path is a hub's socket, anything else a SocketCAN interface.

    Raises:
        DeviceMissing: nothing listens at the path, or there is no such interface.
    """
    if "/" in channel:
        return _open_hub(channel)
    try:
        return can.Bus(interface="socketcan", channel=channel)
    except (OSError, can.CanError) as error:
        raise DeviceMissing(
            f"CAN interface {channel}: {error}. Expected a SocketCAN interface that is up; try "
            f"`ip link set {channel} up type can bitrate {bitrate}`, or see `ip link` for its name"
        ) from error


def _open_hub(path: str) -> can.BusABC:
    try:
        return HubBus(path)
    except can.CanInitializationError as error:
        raise DeviceMissing(
            f"{error}. Expected a CAN hub at {path}; start the twin first"
        ) from error
