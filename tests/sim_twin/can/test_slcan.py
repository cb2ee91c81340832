"""Drive emulated wheel drives through a serial CAN adapter on a pseudo-terminal."""

import select
import time
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest
from can.interfaces.slcan import slcanBus

from drivers.can.interface import open_can_bus
from drivers.can.slcan import SerialCanBus
from drivers.canopen import DriveSpec, PowerState, WheelDriveBus
from drivers.errors import LinkLost
from drivers.wheel_drives.bus import DriveState
from sim_twin.can import MotorMounting, WheelDrive
from sim_twin.can.bus.slcan import SlcanAdapter
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld
from sim_twin.ports.pty_line import PtyLine

TICK_NS = 4_000_000
PATIENCE_NS = 10_000_000_000


class AdapterWorld(FreeWheelWorld[WheelDrive]):
    """Two drives behind an adapter, in real time: terminals pass bytes on when they like."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            [FreeWheel(WheelDrive(1)), FreeWheel(WheelDrive(2, MotorMounting(sign=-1)))],
            time.monotonic_ns(),
        )
        self.line = PtyLine(SlcanAdapter(self.wire), path)

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        while True:
            super().sleep_until(time.monotonic_ns())
            select.select([self.line.fileno()], [], [], 0.0005)
            self.line.poll_once()
            if time.monotonic_ns() >= deadline_ns:
                return


@pytest.fixture
def world(tmp_path: Path) -> Iterator[AdapterWorld]:
    world = AdapterWorld(tmp_path / "adapter")
    yield world
    world.line.close()


def passed_on(world: AdapterWorld, bus: can.BusABC) -> can.Message:
    """Wait, on a busy machine too, until the terminal has passed a frame on to the host."""
    deadline_ns = world.now_ns() + PATIENCE_NS
    while (frame := bus.recv(0.0)) is None:
        assert world.now_ns() < deadline_ns, "nothing came"
        world.sleep_until(world.now_ns())
    return frame


def taken_in(world: AdapterWorld, heard: list[can.Message], count: int) -> can.Message:
    """Wait until the wire has heard that many frames of the host, and return the last."""
    deadline_ns = world.now_ns() + PATIENCE_NS
    while len(heard) < count:
        assert world.now_ns() < deadline_ns, f"heard {heard}"
        world.sleep_until(world.now_ns())
    return heard[-1]


def opened(world: AdapterWorld) -> WheelDriveBus:
    specs = [DriveSpec(node_id=1, joint="left"), DriveSpec(node_id=2, joint="right", sign=-1)]
    channel = open_can_bus(f"slcan:{world.line.link_path}", 1_000_000)
    return WheelDriveBus(channel, world, specs, heartbeat_s=1.0)


def run(world: AdapterWorld, bus: WheelDriveBus, ticks: int, velocity: float) -> DriveState:
    for _ in range(ticks):
        state = bus.cycle(np.full(2, velocity))
        world.sleep_until(world.now_ns() + TICK_NS)
    return state


def test_a_full_session_goes_through_the_adapter(world: AdapterWorld) -> None:
    bus = opened(world)
    bus.connect()
    bus.enable()
    state = run(world, bus, 150, 3.0)
    assert state.enabled
    assert state.velocity_rad_s == pytest.approx([3.0, 3.0], abs=0.05)
    world.wheels[0].drive.raise_fault(0x4310, 0x09)
    state = run(world, bus, 60, 3.0)
    assert state.faulted == (True, False)
    assert state.fault[0] is not None
    assert state.fault[0].text == "0x4310 drive over-temperature"
    assert bus.reset_fault() == ()
    state = run(world, bus, 30, 0.0)
    assert state.power_state == (PowerState.SWITCH_ON_DISABLED,) * 2
    assert bus.counters["malformed"] == 0
    bus.close()


def test_a_pulled_adapter_is_a_lost_link_and_a_new_one_is_connected(world: AdapterWorld) -> None:
    bus = opened(world)
    bus.connect()
    world.line.unplug()
    with pytest.raises(LinkLost, match="CAN adapter"):
        for _ in range(3):
            bus.cycle(None)
    bus.close()
    world.line.replug()
    again = opened(world)
    again.connect()
    assert run(world, again, 5, 0.0).healthy
    again.close()


def test_a_wrong_bit_rate_lets_nothing_through(world: AdapterWorld) -> None:
    heard: list[can.Message] = []
    world.wire.attach(heard.append)
    bus = SerialCanBus(str(world.line.link_path), 500_000)
    bus.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"abc"))
    world.sleep_until(world.now_ns() + TICK_NS)
    assert not any(frame.arbitration_id == 0x123 for frame in heard)
    bus.shutdown()


def test_every_kind_of_frame_survives_both_ways(world: AdapterWorld) -> None:
    frames = [
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b""),
        can.Message(arbitration_id=0x12, is_extended_id=False, is_remote_frame=True, dlc=3),
    ]
    heard: list[can.Message] = []
    world.wire.attach(heard.append)
    bus = SerialCanBus(str(world.line.link_path), 1_000_000)
    world.sleep_until(world.now_ns() + TICK_NS)
    heard.clear()
    for count, frame in enumerate(frames, start=1):
        bus.send(frame)
        came = taken_in(world, heard, count)
        world.wire.send(frame, heard.append)
        back = passed_on(world, bus)
        assert came.equals(frame, timestamp_delta=None, check_channel=False)
        assert back.equals(frame, timestamp_delta=None, check_channel=False)
    bus.shutdown()


def test_the_librarys_own_adapter_bus_is_served_too(world: AdapterWorld) -> None:
    bus = slcanBus(str(world.line.link_path), bitrate=1_000_000, sleep_after_open=0.0, timeout=0.0)
    world.sleep_until(world.now_ns() + TICK_NS)
    world.wheels[0].drive.set_supply(on=False)
    world.wheels[0].drive.set_supply(on=True)
    assert passed_on(world, bus).arbitration_id == 0x701
    bus.shutdown()


@pytest.mark.parametrize("line", [b"S9", b"x", b"t12", b"t1231Z1", b"tFFF0", b"t7FF9", b"\xff\xfe"])
def test_a_line_that_is_no_command_is_answered_by_a_bell(world: AdapterWorld, line: bytes) -> None:
    adapter = SlcanAdapter(world.wire)
    adapter.receive(b"S8\rO\r")
    adapter.transmit()
    adapter.receive(line + b"\r")
    assert adapter.transmit() == b"\a"
