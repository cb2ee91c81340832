"""The state of the bus itself: error frames, bus-off, full buffers, noise."""

from collections import deque
from collections.abc import Iterator

import can
import numpy as np
import pytest

from drivers.can.errors import BusOff, ControllerState, describe
from drivers.can.link import CanLink
from drivers.canopen import DriveSpec, PowerState, WheelDriveBus
from drivers.errors import LinkLost
from sim_twin.can import MemoryBus, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld
from sim_twin.contracts.scripted import ManualClock


class QueueBus(can.BusABC):  # type: ignore[misc]
    """Deliver what a test queued, exceptions included."""

    def __init__(self) -> None:
        self.channel_info = "queue"
        self.incoming: deque[can.Message | Exception] = deque()
        self.full = False
        super().__init__(channel="queue")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.full:
            raise can.CanOperationError("Transmit buffer full", 105)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self.incoming:
            return None
        item = self.incoming.popleft()
        if isinstance(item, Exception):
            raise item
        return item


@pytest.fixture
def bus() -> QueueBus:
    return QueueBus()


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def link(bus: QueueBus, clock: ManualClock) -> Iterator[CanLink]:
    link = CanLink(bus, clock)
    yield link
    link.close()


def error_frame(classes: int, controller: int = 0) -> can.Message:
    return can.Message(
        arbitration_id=classes, is_error_frame=True, data=bytes((0, controller, 0, 0, 0, 0, 0, 0))
    )


@pytest.mark.parametrize(
    ("frame", "state", "words"),
    [
        (error_frame(0x04, 0x08), ControllerState.WARNING, "error warning"),
        (error_frame(0x04, 0x20), ControllerState.PASSIVE, "error passive"),
        (error_frame(0x04, 0x40), ControllerState.ACTIVE, "error active"),
        (error_frame(0x104, 0x40), ControllerState.ACTIVE, "controller restarted"),
    ],
)
def test_error_frames_show_the_controllers_state(
    bus: QueueBus, link: CanLink, frame: can.Message, state: ControllerState, words: str
) -> None:
    bus.incoming.append(frame)
    assert link.drain() == []
    assert link.controller is state
    assert words in describe(frame)
    assert bool(link.trouble) == (state is not ControllerState.ACTIVE)


def test_lost_arbitration_and_missing_acknowledgements_are_counted(
    bus: QueueBus, link: CanLink
) -> None:
    bus.incoming.extend([error_frame(0x02), error_frame(0x20), error_frame(0x22)])
    link.drain()
    counters = link.counters
    assert (counters["arbitration_lost"], counters["not_acknowledged"]) == (2, 2)
    assert counters["error_frames"] == 3


def test_bus_off_is_a_lost_link_with_a_remedy(bus: QueueBus, link: CanLink) -> None:
    bus.incoming.append(error_frame(0x40))
    with pytest.raises(BusOff, match="restart-ms 100"):
        link.drain()
    assert issubclass(BusOff, LinkLost)
    assert "bus-off" in link.trouble


def test_a_transmit_buffer_that_stays_full_is_named(
    bus: QueueBus, link: CanLink, clock: ManualClock
) -> None:
    bus.full = True
    link.send(0x123, b"a")
    assert link.trouble == ""
    clock.sleep_until(300_000_000)
    assert "transmit buffer is full since 0.3 s: no other node acknowledges" in link.trouble
    assert link.frames_dropped == 1
    bus.full = False
    link.send(0x123, b"a")
    assert link.trouble == ""


def test_a_vanished_interface_is_a_lost_link(bus: QueueBus, link: CanLink) -> None:
    bus.incoming.append(can.CanOperationError("network is down", 100))
    with pytest.raises(LinkLost, match="network is down"):
        link.drain()


def test_noise_is_counted_and_what_follows_is_read(bus: QueueBus, link: CanLink) -> None:
    good = can.Message(arbitration_id=1, is_extended_id=False, data=b"x")
    bus.incoming.extend([ValueError("no hex"), IndexError("short"), good])
    assert [frame.arbitration_id for frame in link.drain()] == [1]
    assert link.frames_malformed == 2


def test_a_babbling_node_cannot_hold_the_caller_up(bus: QueueBus, link: CanLink) -> None:
    frame = can.Message(arbitration_id=1, is_extended_id=False)
    bus.incoming.extend([frame] * 1000)
    assert len(link.drain()) == 256


def test_after_bus_off_the_drives_are_reconnected_and_disabled() -> None:
    world = FreeWheelWorld([FreeWheel(WheelDrive(1))])
    specs = [DriveSpec(node_id=1, joint="left")]

    def fresh() -> WheelDriveBus:
        return WheelDriveBus(MemoryBus(world.wire), world, specs, heartbeat_s=0.1)

    bus = fresh()
    bus.connect()
    bus.enable()
    for _ in range(50):
        bus.cycle(np.array([3.0]))
        world.sleep_until(world.now_ns() + 4_000_000)
    assert bus.enabled
    world.wire.set_bus_off()
    with pytest.raises(BusOff):
        bus.cycle(np.array([3.0]))
    bus.close()
    world.sleep_until(world.now_ns() + 600_000_000)
    assert abs(world.wheels[0].velocity_rad_s) < 0.05
    world.wire.restart()
    world.sleep_until(world.now_ns() + 100_000_000)
    again = fresh()
    again.connect()
    state = again.cycle(None)
    assert state.healthy
    assert state.power_state == (PowerState.SWITCH_ON_DISABLED,)
    again.close()


def test_a_frame_goes_out_with_its_own_data_whatever_went_before_it(
    bus: QueueBus, link: CanLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[tuple[int, bytes, bool, int]] = []

    def note(msg: can.Message, timeout: float | None = None) -> None:
        sent.append((msg.arbitration_id, bytes(msg.data), msg.is_remote_frame, msg.dlc))

    monkeypatch.setattr(bus, "send", note)
    for data in (b"\x01", b"\x01", b"\x02\x03", b""):
        link.send(0x201, data)
    link.send(0x202, b"\x01")
    link.send(0x201, remote=True, dlc=8)
    link.send(0x201)
    assert sent == [
        (0x201, b"\x01", False, 1),
        (0x201, b"\x01", False, 1),
        (0x201, b"\x02\x03", False, 2),
        (0x201, b"", False, 0),
        (0x202, b"\x01", False, 1),
        (0x201, b"", True, 8),
        (0x201, b"", False, 0),
    ]
