"""Open a robot's devices by name, so that a node never knows whether a wire or the twin answers."""

from typing import Protocol

import can

from drivers.base import ByteTransport


class DeviceOpener(Protocol):
    """Hand out the transport of each named device: "servos", "lidar", "imu", "camera", "can"."""

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

    def can(self, name: str) -> can.BusABC:
        """Open a CAN bus.

        Raises:
            DeviceMissing: the interface is not there.
        """
        ...
