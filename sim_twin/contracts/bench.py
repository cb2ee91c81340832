"""Put one device on the bench: on an emulated wire, behind a real terminal or socket, or in life.

A contract test opens the device, lets time pass, and may spoil the line where the bench can.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, Generic, Protocol, TypeVar

import numpy as np

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.errors import DeviceMissing
from drivers.serial_port import SerialPort
from drivers.socket_stream import SocketStream
from sim_twin.contracts.scripted import ManualClock
from sim_twin.device import WireDevice
from sim_twin.faults.line_tamper import LineTamper, Tampering
from sim_twin.faults.plug import Plug
from sim_twin.ports.lines import MemoryLine
from sim_twin.ports.pty_line import PtyLine
from sim_twin.ports.stream_line import StreamLine

STEP_NS: Final = 2_000_000

D = TypeVar("D")
D_co = TypeVar("D_co", covariant=True)
Connect = Callable[[ByteTransport, Clock], D]


class Bench(Protocol[D_co]):
    """Hold one device that a driver can open again and again."""

    @property
    def clock(self) -> Clock:
        """Return the clock that drivers on this bench use."""
        ...

    def open(self) -> D_co:
        """Return a driver that has just opened the device.

        Raises:
            DriverError: the device is not there.
        """
        ...

    def let(self, seconds: float) -> None:
        """Let time pass."""
        ...


class PluggedBench(Bench[D_co], Protocol):
    """Hold a device whose cable can be pulled."""

    def unplug(self) -> None:
        """Pull the cable."""
        ...

    def replug(self) -> None:
        """Put the cable in again."""
        ...


class WireBench(Generic[D]):
    """Hold an emulated device on an in-memory line and a clock of its own; it can do every fault.

    `hang_up` tells a device that its host has gone, where the device wants to know.
    """

    def __init__(
        self, device: WireDevice, connect: Connect[D], hang_up: Callable[[], None] | None = None
    ) -> None:
        self.clock = ManualClock(NS_PER_S)
        self._device = device
        self._line = LineTamper(device, self.clock.now_ns)
        self._plug = Plug()
        self._connect = connect
        self._hang_up = hang_up

    def open(self) -> D:
        """Return a driver on a fresh line.

        Raises:
            DeviceMissing: the cable is out.
        """
        if not self._plug.is_in:
            raise DeviceMissing("bench: unplugged; plug it in")
        if self._hang_up is not None:
            self._hang_up()
        line = MemoryLine(self._line, self.clock)
        self._plug.add_connection(line)
        return self._connect(line, self.clock)

    def let(self, seconds: float) -> None:
        """Step the device and its clock."""
        end_ns = self.clock.ns + round(seconds * NS_PER_S)
        while self.clock.ns < end_ns:
            self.clock.ns += STEP_NS
            self._device.step(self.clock.ns)

    def unplug(self) -> None:
        """Pull the cable."""
        self._plug.pull()

    def replug(self) -> None:
        """Put the cable in again."""
        self._plug.push()

    @contextmanager
    def spoiled(self, tampering: Tampering) -> Iterator[None]:
        """Spoil the line for a while."""
        self._line.add(tampering)
        yield
        self._line.remove(tampering)


class Server(Protocol):
    """Serve a device to another process."""

    def poll_once(self) -> object:
        """Move bytes as far as they go."""
        ...

    def close(self) -> None:
        """Take the device away."""
        ...


class ServedBench(Generic[D]):
    """Hold an emulated device behind a real path, on the wall clock; its cable can be pulled."""

    def __init__(
        self, device: WireDevice, serve: Callable[[], Server], connect: Callable[[Clock], D]
    ) -> None:
        self.clock = MonotonicClock()
        self._device = device
        self._serve = serve
        self._connect = connect
        self._server: Server | None = serve()

    def open(self) -> D:
        """Return a driver on the path.

        Raises:
            DeviceMissing: the cable is out.
        """
        return self._connect(self.clock)

    def let(self, seconds: float) -> None:
        """Step and serve the device in real time."""
        end_ns = self.clock.now_ns() + round(seconds * NS_PER_S)
        while (now_ns := self.clock.now_ns()) < end_ns:
            self._device.step(now_ns)
            if self._server is not None:
                self._server.poll_once()
            self.clock.sleep_until(now_ns + STEP_NS)

    def unplug(self) -> None:
        """Take the path away."""
        self.close()

    def replug(self) -> None:
        """Serve the path again."""
        self._server = self._serve()

    def close(self) -> None:
        """Stop serving; closing twice is allowed."""
        if self._server is not None:
            self._server.close()
        self._server = None


def pty_bench(device: WireDevice, connect: Connect[D], path: Path, baud: int) -> ServedBench[D]:
    """Return a bench with a serial device behind a pseudo-terminal."""
    return ServedBench(
        device,
        lambda: PtyLine(device, path),
        lambda clock: connect(SerialPort(path, baud, clock), clock),
    )


def socket_bench(
    device: WireDevice, connect: Connect[D], path: Path, hang_up: Callable[[], None]
) -> ServedBench[D]:
    """Return a bench with a streaming device behind a Unix socket."""
    return ServedBench(
        device,
        lambda: StreamLine(device, path, hang_up),
        lambda clock: connect(SocketStream(path, clock), clock),
    )


class HardwareBench(Generic[D]):
    """Hold a real device; `connect` opens it, time passes by itself."""

    def __init__(self, connect: Callable[[Clock], D]) -> None:
        self.clock = MonotonicClock()
        self._connect = connect

    def open(self) -> D:
        """Return a driver on the device.

        Raises:
            DriverError: the device is not there, busy or not the one declared.
        """
        return self._connect(self.clock)

    def let(self, seconds: float) -> None:
        """Wait."""
        self.clock.sleep_until(self.clock.now_ns() + round(seconds * NS_PER_S))


class Truncation:
    """Lose one byte in `every` of what the device says, at random places."""

    def __init__(self, every: int, seed: int) -> None:
        self._share = 1.0 / every
        self._random = np.random.default_rng(seed)

    def heard(self, data: bytes, now_ns: int) -> bytes:
        """Pass on."""
        return data

    def said(self, data: bytes, now_ns: int) -> bytes:
        """Return what is left."""
        kept = self._random.random(len(data)) >= self._share
        return np.frombuffer(data, np.uint8)[kept].tobytes()
