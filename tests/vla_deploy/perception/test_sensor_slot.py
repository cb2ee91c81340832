from dataclasses import dataclass, field

import pytest

from drivers.errors import DeviceMissing, LinkLost
from vla_deploy.perception.sensor_slot import SensorSlot


@dataclass
class FakeClock:
    ns: int = 0

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)


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

    def connect(self) -> Thermometer:
        if not self.present:
            raise DeviceMissing("line: not there")
        self.made.append(Thermometer())
        return self.made[-1]


def test_a_missing_sensor_at_the_start_is_told() -> None:
    slot = SensorSlot("thermometer", Socket(present=False).connect, FakeClock())
    with pytest.raises(DeviceMissing):
        slot.open()


def test_a_lost_sensor_is_closed_and_tried_again_once_a_second() -> None:
    clock, socket = FakeClock(), Socket()
    slot = SensorSlot("thermometer", socket.connect, clock)
    slot.open()
    assert slot.poll(Thermometer.read, 0) == 21
    socket.made[0].plugged = socket.present = False
    assert slot.poll(Thermometer.read, 0) == 0
    assert socket.made[0].closed == 1
    socket.present = True
    clock.ns += 999_000_000
    assert slot.poll(Thermometer.read, 0) == 0
    clock.ns += 1_000_000
    assert slot.poll(Thermometer.read, 0) == 21
    assert slot.reconnects == 1


def test_closing_twice_is_allowed() -> None:
    socket = Socket()
    slot = SensorSlot("thermometer", socket.connect, FakeClock())
    slot.open()
    slot.close()
    slot.close()
    assert socket.made[0].closed == 1
