"""Drive emulated wheel drives through a serial CAN adapter on a pseudo-terminal."""

import re
import select
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from can.interfaces.slcan import slcanBus
from hypothesis import given
from hypothesis import strategies as st

from drivers.can.interface import open_can_bus
from drivers.can.slcan import SerialCanBus, format_line
from drivers.canopen import DriveSpec, PowerState, WheelDriveBus
from drivers.errors import LinkLost
from drivers.wheel_drives.bus import DriveState
from sim_twin.can import CanWire, MotorMounting, WheelDrive
from sim_twin.can.bus.slcan import MAX_LINE_BYTES, MAX_OUTPUT_BYTES, SlcanAdapter
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


def librarys_bus(path: str, bitrate: int) -> can.BusABC:
    """Open an adapter as a foreign client does: with python-can's own slcan interface."""
    return slcanBus(path, bitrate=bitrate, sleep_after_open=0.0, timeout=0.0)


@pytest.mark.parametrize("host", [SerialCanBus, librarys_bus])
def test_every_kind_of_frame_survives_both_ways(
    world: AdapterWorld, host: Callable[[str, int], can.BusABC]
) -> None:
    frames = [
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b""),
        can.Message(arbitration_id=0x12, is_extended_id=False, is_remote_frame=True, dlc=3),
    ]
    heard: list[can.Message] = []
    world.wire.attach(heard.append)
    bus = host(str(world.line.link_path), 1_000_000)
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


class Desk:
    """Type lines to an adapter, with one more port on its wire."""

    def __init__(self) -> None:
        self.wire = CanWire()
        self.heard: list[can.Message] = []
        self.wire.attach(self.heard.append)
        self.adapter = SlcanAdapter(self.wire)

    def type(self, text: bytes) -> bytes:
        self.adapter.receive(text)
        return self.adapter.transmit()

    def carry(self, **fields: Any) -> bytes:
        """Let the other port send a frame."""
        self.wire.send(can.Message(is_extended_id=False, **fields), self.heard.append)
        return self.adapter.transmit()


@pytest.fixture
def desk() -> Desk:
    return Desk()


DIALOGUES: list[tuple[bytes, bytes]] = [
    (b"\r", b"\r"),
    (b"V\rN\r", b"V1013\rNTWIN\r"),
    (b"O\r", b"\a"),  # no bit rate yet
    (b"S8\rO\rO\r", b"\r\r\a"),
    (b"S8\rO\rC\rC\rO\r", b"\r\r\r\r\r"),
    (b"S8\rO\rS6\rZ1\r", b"\r\r\a\a"),
    (b"Z1\rZ0\rZ2\rZ\r", b"\r\r\a\a"),
    (b"F\rS8\rO\rF\r", b"\a\r\rF00\r"),
    (b"S8\rO\rt1232AABB\rT1ABCDEF00\rr1234\r", b"\r\rz\rZ\rz\r"),
    (b"t1230\r", b"\a"),  # the channel is closed
    (b"S8\rL\rt1230\r", b"\r\r\a"),
    (b"S8\rO\rt12", b"\r\r"),  # half a line is not yet refused
    (b"x" * 9999, b""),
    (b"x" * 9999 + b"V\rV\r", b"\aV1013\r"),
]


@pytest.mark.parametrize(("typed", "answered"), DIALOGUES)
def test_commands_are_answered_as_lawicels_manual_says(
    desk: Desk, typed: bytes, answered: bytes
) -> None:
    assert desk.type(typed) == answered


REFUSED = """S9 S S88 O1 C1 V1 N1 F1 x t t12 t1231Z1 tFFF0 t8000 t1239 t123 t1231A t12312233
t12301234 t+120 t0x10 t1_20 r12341122 T200000000 T1ABCDEF"""
REFUSED_WITH_SPACES = ("t1232 1122", "\n", "t1230\n", "\xff")


@pytest.mark.parametrize("line", [*REFUSED.split(), *REFUSED_WITH_SPACES])
def test_a_line_that_is_no_command_is_answered_by_a_bell(desk: Desk, line: str) -> None:
    desk.type(b"S8\rO\r")
    assert desk.type(line.encode("latin-1") + b"\r") == b"\a"
    assert desk.heard == []


def test_frames_are_stamped_with_the_milliseconds_of_a_minute(desk: Desk) -> None:
    desk.type(b"Z1\rS8\rO\r")
    desk.adapter.step(61_234_567_890)
    assert desk.carry(arbitration_id=0x123, data=b"\x01") == b"t12310104D2\r"


def test_a_closed_channel_is_not_on_the_bus(desk: Desk) -> None:
    desk.type(b"S8\rO\rC\r")
    assert desk.carry(arbitration_id=0x123) == b""
    assert desk.wire.health(desk.heard.append).tec > 0  # nobody has acknowledged


def test_flags_tell_once_of_lost_frames_and_for_as_long_as_it_lasts_of_errors(desk: Desk) -> None:
    desk.type(b"S8\rO\r")
    for _ in range(MAX_OUTPUT_BYTES // 5 + 2):
        desk.wire.send(can.Message(arbitration_id=1, is_extended_id=False), desk.heard.append)
    desk.adapter.transmit()
    assert desk.adapter.frames_dropped > 0
    assert desk.type(b"F\rF\r") == b"F08\rF00\r"
    desk.wire.set_bus_off()
    assert desk.type(b"t1230\rF\rF\r") == b"\aFA6\rF24\r"


CHARACTERS = b"tTrRSOLCVNFZ0123456789ABCDEFabcdef\r\r\r\n \xff"


@given(
    st.lists(
        st.binary(max_size=100) | st.lists(st.sampled_from(CHARACTERS), max_size=100).map(bytes)
    )
)
def test_any_bytes_get_one_answer_for_each_line_and_no_frame_that_was_not_typed(
    chunks: list[bytes],
) -> None:
    desk = Desk()
    opening = b"S8\rO\r"
    answers = b"".join(desk.type(chunk) for chunk in [opening, *chunks])
    typed = opening + b"".join(chunks)
    assert len(re.findall(rb"[^\r\a]*[\r\a]", answers)) == typed.count(b"\r")
    assert re.fullmatch(rb"(?:(?:[zZ]|V1013|NTWIN|F..)?\r|\a)*", answers)
    assert len(desk.adapter._input) <= MAX_LINE_BYTES
    lines = [line.upper() for line in typed.split(b"\r")]
    assert all(format_line(frame).upper().encode() in lines for frame in desk.heard)
