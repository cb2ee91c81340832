"""A device that goes away is tried again, less and less often, without blocking."""

from dataclasses import dataclass, field

import pytest

from drivers.errors import DeviceMissing, LinkLost
from drivers.reopening import Reopening
from sim_twin.contracts.scripted import ManualClock

MS = 1_000_000


@dataclass
class Thermometer:
    plugged: bool = True
    closed: int = 0

    def read(self) -> int:
        if not self.plugged:
            raise LinkLost("line: pulled out")
        return 21

    def close(self) -> None:
        self.closed += 1


@dataclass
class Socket:
    made: list[Thermometer] = field(default_factory=list)
    present: bool = True
    asked: int = 0

    def connect(self) -> Thermometer:
        self.asked += 1
        if not self.present:
            raise DeviceMissing("line: not there")
        self.made.append(Thermometer())
        return self.made[-1]


def make() -> tuple[Reopening[Thermometer], Socket, ManualClock]:
    clock, socket = ManualClock(), Socket()
    device = Reopening("thermometer", socket.connect, clock)
    device.open()
    return device, socket, clock


def pull(socket: Socket) -> None:
    socket.made[-1].plugged = socket.present = False


def test_a_device_missing_at_the_start_is_an_error() -> None:
    device = Reopening("thermometer", Socket(present=False).connect, ManualClock())
    with pytest.raises(DeviceMissing):
        device.open()


def test_a_lost_device_is_closed_and_says_why_until_it_is_back() -> None:
    device, socket, clock = make()
    assert device.poll(Thermometer.read, 0) == 21
    pull(socket)
    assert device.poll(Thermometer.read, 0) == 0
    assert socket.made[0].closed == 1
    assert device.failure == "line: pulled out"
    socket.present = True
    clock.ns += 250 * MS
    assert device.poll(Thermometer.read, 0) == 21
    assert (device.failure, device.reconnects) == ("", 1)


def test_the_pauses_between_attempts_double_up_to_four_seconds() -> None:
    device, socket, clock = make()
    pull(socket)
    attempts_ms = []
    for ms in range(0, 20_000, 10):
        before, clock.ns = socket.asked, ms * MS
        device.poll(Thermometer.read, 0)
        if socket.asked > before:
            attempts_ms.append(ms)
    assert attempts_ms == [250, 750, 1750, 3750, 7750, 11750, 15750, 19750]
    assert device.failure == "line: not there"


def test_a_device_that_came_back_is_tried_quickly_again() -> None:
    device, socket, clock = make()
    pull(socket)
    for _ in range(2000):
        clock.ns += 10 * MS
        device.poll(Thermometer.read, 0)
    socket.present = True
    clock.ns += 5000 * MS
    assert device.poll(Thermometer.read, 0) == 21
    socket.made[-1].plugged = False
    device.poll(Thermometer.read, 0)
    clock.ns += 250 * MS
    assert device.poll(Thermometer.read, 0) == 21


def test_closing_twice_is_allowed() -> None:
    device, socket, _ = make()
    device.close()
    device.close()
    assert socket.made[0].closed == 1
