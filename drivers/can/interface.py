"""Open the CAN bus that the robot file names: SocketCAN, a serial adapter, or the twin's hub."""

import errno
from pathlib import Path
from typing import Final

import can

from drivers.can.slcan import SerialCanBus
from drivers.can_hub import HubBus
from drivers.errors import DeviceMissing

SERIAL_PREFIX: Final = "slcan:"
SYSFS_NET: Final = Path("/sys/class/net")
_NO_CAN: Final = frozenset({errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT})


def open_can_bus(
    channel: str, bitrate: int = 1_000_000, *, sysfs_net: Path = SYSFS_NET
) -> can.BusABC:
    """Open `channel`: `slcan:/dev/…` a serial adapter, another path a hub, else SocketCAN.

    Raises:
        DeviceMissing: nothing listens at the path, or there is no such interface or adapter.
    """
    if channel.startswith(SERIAL_PREFIX):
        return _open_serial(channel.removeprefix(SERIAL_PREFIX), bitrate)
    if "/" in channel:
        return _open_hub(channel)
    return _open_socketcan(channel, bitrate, sysfs_net)


def _open_socketcan(channel: str, bitrate: int, sysfs_net: Path) -> can.BusABC:
    up = f"`ip link set {channel} up type can bitrate {bitrate} restart-ms 100`"
    try:
        bus = can.Bus(interface="socketcan", channel=channel)
    except (OSError, can.CanError) as error:
        if getattr(error, "errno", None) in _NO_CAN:
            raise DeviceMissing(
                f"CAN interface {channel}: this kernel has no SocketCAN (AF_CAN, errno 97). Load "
                "it with `modprobe can_raw` and the controller's driver (`modprobe mttcan` on a "
                "Jetson), use a kernel that has it, or take a serial adapter by `slcan:/dev/…`"
            ) from error
        raise DeviceMissing(
            f"CAN interface {channel}: {error}. Expected a SocketCAN interface that is up; try "
            f"{up}, or see `ip link` for its name"
        ) from error
    if _is_down(channel, sysfs_net):
        bus.shutdown()
        raise DeviceMissing(
            f"CAN interface {channel} is down or bus-off. Try {up}; with restart-ms the controller "
            "comes back from bus-off by itself"
        )
    return bus


def _is_down(channel: str, sysfs_net: Path) -> bool:
    """Return what the kernel shows without netlink; an interface without the file counts as up."""
    try:
        return (sysfs_net / channel / "operstate").read_text().strip() == "down"
    except OSError:
        return False


def _open_serial(path: str, bitrate: int) -> can.BusABC:
    what = f"CAN adapter {path}"
    try:
        return SerialCanBus(path, bitrate)
    except ValueError as error:
        raise DeviceMissing(
            f"{what}: bit rate {bitrate}: {error}; correct the robot file"
        ) from error
    except can.CanInitializationError as error:
        raise DeviceMissing(
            f"{what}: {error}. Expected an slcan adapter; see /dev/serial/by-id for its path"
        ) from error


def _open_hub(path: str) -> can.BusABC:
    try:
        return HubBus(path)
    except can.CanInitializationError as error:
        raise DeviceMissing(
            f"{error}. Expected a CAN hub at {path}; start the twin first"
        ) from error
