"""Run `canopen`'s SDO client without its receiving thread: whoever waits reads the bus itself.

So the bus is read by one thread only, nothing races, and simulated time steps deterministically.
"""

import errno
from collections.abc import Callable
from typing import Final

import can
import canopen
from canopen.sdo import SdoClient
from canopen.sdo.constants import RESPONSE_ABORTED

from drivers.canopen.objects import FUNCTION_CODE_MASK, SDO_REPLY_COB, SDO_REQUEST_COB
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost, ProtocolError

POLL_NS: Final = 1_000_000
SDO_TIMEOUT_NS: Final = 300_000_000
# What a CAN interface says when it is down or unplugged; anything else is a full transmit queue.
_GONE: Final = frozenset(
    {errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.ENETUNREACH, errno.EBADF, errno.EPIPE}
)


class CanNetwork(canopen.Network):  # type: ignore[misc]
    """Send and receive frames of one bus for the driver and for `canopen`'s SDO clients."""

    def __init__(self, bus: can.BusABC, clock: Clock) -> None:
        super().__init__(bus)
        self.clock = clock
        self.frames_sent = 0
        self.frames_received = 0
        self.frames_dropped = 0
        self.frames_malformed = 0
        self.on_frame: Callable[[int, bytes], None] = lambda can_id, data: None

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Put one frame on the bus; a full transmit queue drops and counts it.

        Raises:
            LinkLost: the interface is down or gone.
        """
        message = can.Message(
            arbitration_id=can_id, is_extended_id=False, is_remote_frame=remote, data=data
        )
        try:
            self.bus.send(message, timeout=0.0)
        except can.CanError as error:
            _raise_if_gone(error, self.bus.channel_info)
            self.frames_dropped += 1
            return
        self.frames_sent += 1

    def receive_one(self, timeout_s: float) -> bool:
        """Read and hand on at most one frame; tell whether there was one.

        Raises:
            LinkLost: the interface is down or gone.
        """
        try:
            message = self.bus.recv(timeout_s)
        except ProtocolError:
            self.frames_malformed += 1
            return True
        except can.CanError as error:
            raise LinkLost(f"{self.bus.channel_info}: {error}") from error
        if message is None:
            return False
        self._dispatch(message)
        return True

    def _dispatch(self, message: can.Message) -> None:
        self.frames_received += 1
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            return
        can_id = message.arbitration_id
        if can_id & FUNCTION_CODE_MASK == SDO_REPLY_COB:
            self.notify(can_id, message.data, message.timestamp)
        else:
            self.on_frame(can_id, bytes(message.data))

    def wait(self, done: Callable[[], bool], timeout_ns: int) -> bool:
        """Read frames until `done()` or the time is up; return `done()`."""
        deadline_ns = self.clock.now_ns() + timeout_ns
        while not done():
            poll_end_ns = self.clock.now_ns() + POLL_NS
            if poll_end_ns > deadline_ns:
                return False
            if not self.receive_one(POLL_NS / NS_PER_S):
                self.clock.sleep_until(poll_end_ns)
        return True


def _raise_if_gone(error: can.CanError, channel: str) -> None:
    if isinstance(error, LinkLost):
        raise error
    if error.error_code in _GONE:
        raise LinkLost(f"{channel}: {error}") from error


class PumpedSdoClient(SdoClient):  # type: ignore[misc]
    """Wait for an SDO reply by reading the bus instead of a queue that a thread fills."""

    def __init__(self, network: CanNetwork, node_id: int, od: canopen.ObjectDictionary) -> None:
        super().__init__(SDO_REQUEST_COB + node_id, SDO_REPLY_COB + node_id, od)
        self.network = network
        network.subscribe(self.tx_cobid, self.on_response)

    def read_response(self) -> bytes:
        """Return the server's reply.

        Raises:
            canopen.SdoAbortedError: the server refuses.
            canopen.SdoCommunicationError: no reply within the time limit.
        """
        if not self.network.wait(lambda: not self.responses.empty(), SDO_TIMEOUT_NS):
            raise canopen.SdoCommunicationError("No SDO response received")
        response: bytes = self.responses.get_nowait()
        if len(response) != 8:
            raise canopen.SdoCommunicationError(f"SDO response of {len(response)} bytes")
        if response[0] == RESPONSE_ABORTED:
            raise canopen.SdoAbortedError(int.from_bytes(response[4:8], "little"))
        return response
