"""Open a robot's devices by name, so that a node never knows whether a wire or the twin answers."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import can

from drivers.base import ByteTransport
from drivers.can.interface import open_can_bus
from drivers.clock import Clock
from drivers.errors import DeviceMissing
from drivers.estop.gpio_button import Contact
from drivers.estop.gpio_contact import GpioContact
from drivers.estop.input_device import InputDevice
from drivers.gpio import GpioOutput
from drivers.power_relay.base import LevelOutput
from drivers.power_relay.streamed_level import StreamedLevel
from drivers.serial_port import SerialPort
from drivers.socket_stream import SocketStream


class DeviceOpener(Protocol):
    """Hand out the transport of each named device: "servos", "lidar", "camera", "can", "estop"."""

    def serial(self, name: str) -> ByteTransport:
        """Open a serial line.

        Raises:
            DeviceMissing: the device is not there.
            DeviceBusy: another process holds it.
        """
        ...

    def stream(self, name: str) -> ByteTransport:
        """Open a byte stream, such as the RGB-D camera's socket.

        Raises:
            DeviceMissing: nothing serves the stream.
        """
        ...

    def video(self, name: str) -> ByteTransport | str:
        """Return a video device's path, or open the stream that stands in its place.

        Raises:
            DeviceMissing: nothing serves the stream.
        """
        ...

    def can(self, name: str) -> can.BusABC:
        """Open a CAN bus.

        Raises:
            DeviceMissing: the interface is not there.
        """
        ...

    def input_events(self, name: str) -> ByteTransport:
        """Open a source of Linux input events; it begins with the present state of its keys.

        Raises:
            DeviceMissing: the device is not there.
            DeviceBusy: another process has grabbed it.
        """
        ...

    def gpio_contact(self, name: str, offset: int) -> Contact:
        """Open a normally closed contact on a GPIO line.

        Raises:
            DeviceMissing: there is no such chip or line.
            DeviceBusy: another process holds the line.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLink:
    """Say where a device is reached; `baud` is the serial speed or CAN bit rate, 0 for a stream."""

    path: str
    baud: int = 0


class PathOpener:
    """Open real devices, or the twin's, by the paths that the robot file gives them."""

    def __init__(self, links: Mapping[str, DeviceLink], clock: Clock) -> None:
        self._links = links
        self._clock = clock

    def serial(self, name: str) -> SerialPort:
        """Open a serial line.

        Raises:
            DeviceMissing: the device is not there, or the robot file does not name it.
            DeviceBusy: another process holds it.
        """
        link = self._link(name)
        return SerialPort(Path(link.path), link.baud, self._clock)

    def stream(self, name: str) -> SocketStream:
        """Open a byte stream.

        Raises:
            DeviceMissing: nothing serves it, or the robot file does not name it.
        """
        return SocketStream(Path(self._link(name).path), self._clock)

    def video(self, name: str) -> ByteTransport | str:
        """Return a video device's path, or open the stream where the path is a socket's.

        Raises:
            DeviceMissing: nothing serves the stream, or the robot file does not name it.
        """
        path = Path(self._link(name).path)
        return SocketStream(path, self._clock) if path.is_socket() else str(path)

    def can(self, name: str) -> can.BusABC:
        """Open a CAN bus: a SocketCAN interface, or a hub where the path is one of the file system.

        Raises:
            DeviceMissing: the interface is not there, or the robot file does not name it.
        """
        link = self._link(name)
        return open_can_bus(link.path, link.baud)

    def input_events(self, name: str) -> ByteTransport:
        """Open an input device, or a socket that carries the same events.

        Raises:
            DeviceMissing: the device is not there, or the robot file does not name it.
            DeviceBusy: another process has grabbed it.
        """
        path = Path(self._link(name).path)
        if path.is_socket():
            return SocketStream(path, self._clock)
        return InputDevice(path, self._clock, grab=True)

    def gpio_contact(self, name: str, offset: int) -> GpioContact:
        """Open a normally closed contact on a line of the chip that the robot file gives.

        Raises:
            DeviceMissing: there is no such chip or line, or the robot file does not name it.
            DeviceBusy: another process holds the line.
        """
        return GpioContact(self._link(name).path, offset)

    def gpio_output(self, name: str, offset: int) -> LevelOutput:
        """Open a line of the chip that the robot file gives, or a socket that carries its levels.

        Raises:
            DeviceMissing: there is no such chip or line, or the robot file does not name it.
            DeviceBusy: another process holds the line.
        """
        path = Path(self._link(name).path)
        if path.is_socket():
            return StreamedLevel(SocketStream(path, self._clock))
        return GpioOutput(str(path), offset, active_low=False)

    def _link(self, name: str) -> DeviceLink:
        if name not in self._links:
            known = ", ".join(self._links)
            raise DeviceMissing(f"the robot file has no device {name!r}; it has {known}")
        return self._links[name]
