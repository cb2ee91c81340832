"""Connect a driver to an emulated device without an operating system in between.

In lock-step one process runs everything, so a reply is complete as soon as the request is written.
Nothing more can arrive while the driver holds the processor: a read that finds nothing returns b""
at once, whatever its deadline, and simulated time stands still. To the driver this is a deadline
that has passed; that is how a silent device shows.

A device with bytes under way (`TimedDevice`) makes the driver wait: a read moves simulated time to
their arrival, and, where the bus is paced, to the deadline when none comes before it.
"""

from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost
from sim_twin.device import TimedDevice, WireDevice


class MemoryLine:
    """Implement `drivers.base.ByteTransport` on top of a `WireDevice`.

    The device keeps what it wants to send until somebody reads, as far as its own buffer goes.
    """

    def __init__(self, device: WireDevice, clock: Clock) -> None:
        self._device = device
        self._timed = device if isinstance(device, TimedDevice) else None
        self._clock = clock
        self._pending = b""
        self._unplugged_ns: int | None = None

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the device.

        Raises:
            LinkLost: the line is unplugged.
        """
        self._check_plugged()
        self._tell_time()
        self._device.receive(data)

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes that are there, or b"" when none come by the deadline.

        Raises:
            LinkLost: the line is unplugged.
        """
        self._check_plugged()
        arrived = self._pending + self._fetch()
        while not arrived and self._wait_for_bytes(deadline_ns):
            arrived = self._fetch()
        self._pending = arrived[max_bytes:]
        return arrived[:max_bytes]

    def discard_input(self) -> None:
        """Drop what has arrived and was not read."""
        self._fetch()
        self._pending = b""

    def close(self) -> None:
        """Let go of the device, which stays as it is."""
        self._pending = b""

    def unplug(self) -> None:
        """Cut the line; bytes under way are lost."""
        self.discard_input()
        self._unplugged_ns = self._clock.now_ns()

    def replug(self) -> None:
        """Join the line again."""
        self.discard_input()
        self._unplugged_ns = None

    def _tell_time(self) -> None:
        if self._timed is not None:
            self._timed.step(self._clock.now_ns())

    def _fetch(self) -> bytes:
        self._tell_time()
        return self._device.transmit()

    def _wait_for_bytes(self, deadline_ns: int) -> bool:
        """Move time on to the next arrival; False when there is none by the deadline."""
        if self._timed is None:
            return False
        due_ns = self._timed.next_due_ns()
        if due_ns is not None and due_ns <= deadline_ns:
            self._clock.sleep_until(due_ns)
            return True
        if self._timed.paced:
            self._clock.sleep_until(deadline_ns)
        return False

    def _check_plugged(self) -> None:
        if self._unplugged_ns is not None:
            raise LinkLost(
                f"line to {type(self._device).__name__}: unplugged at "
                f"{self._unplugged_ns / NS_PER_S:.3f} s; plug it in and open it again"
            )
