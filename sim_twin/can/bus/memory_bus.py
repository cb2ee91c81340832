"""Reach the emulated nodes from within one process: a python-can bus without sockets or waiting."""

import errno
import os
from collections import deque

import can

from sim_twin.can.bus.wire import CanWire


class MemoryBus(can.BusABC):  # type: ignore[misc]
    """Run the emulated nodes inside `send` and queue what they answer."""

    def __init__(self, wire: CanWire) -> None:
        self.channel_info = "CAN in memory"
        self._wire = wire
        self._received: deque[can.Message] = deque()
        self.port = self._received.append
        wire.attach(self.port)
        super().__init__(channel="memory")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Carry one frame; the answers wait in the queue when this returns.

        Raises:
            can.CanOperationError: the controller's queue is full or it is bus-off, as on SocketCAN;
                or the bus was shut down.
        """
        if self._is_shutdown:
            raise can.CanOperationError(f"{self.channel_info}: was shut down", errno.EBADF)
        if not self._wire.send(msg, self.port):
            raise can.CanOperationError(
                f"{self.channel_info}: {os.strerror(errno.ENOBUFS)}", errno.ENOBUFS
            )

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame or None; never wait, for here only the caller moves time."""
        return self._received.popleft() if self._received else None

    def shutdown(self) -> None:
        """Leave the wire; leaving twice is allowed."""
        if not self._is_shutdown:
            self._wire.detach(self.port)
        super().shutdown()
