from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.errors import LinkLost
from drivers.recording.recorder import RecordingTransport, WireRecorder
from drivers.recording.recording import RecordKind, WireRecord, read_recording
from drivers.recording.replay import ReplayDiverged, WireReplay
from sim_twin.contracts.scripted import ManualClock
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos

US = NS_PER_S // 1_000_000
WRITE, READ, LOST = RecordKind.WRITE, RecordKind.READ, RecordKind.LOST
SESSION = [
    WireRecord(RecordKind.NOTE, 0, b"note"),
    WireRecord(WRITE, 1_000 * US, b"ping"),
    WireRecord(READ, 1_400 * US, b"po"),
    WireRecord(READ, 1_500 * US, b"ng"),
    WireRecord(WRITE, 9_000 * US, b"more"),
    WireRecord(READ, 9_100 * US, b"done"),
]


def test_replies_come_as_late_after_their_request_as_they_did() -> None:
    clock = ManualClock(50 * NS_PER_S)
    wire = WireReplay(SESSION, clock)
    wire.write(b"ping")
    start_ns = clock.ns
    assert wire.read(10, start_ns + 300 * US) == b""
    assert clock.ns == start_ns + 300 * US
    assert wire.read(10, start_ns + NS_PER_S) == b"po"
    assert clock.ns == start_ns + 400 * US
    assert wire.read(10, start_ns + NS_PER_S) == b"ng"
    assert clock.ns == start_ns + 500 * US
    wire.write(b"more")
    assert not wire.finished
    assert wire.read(10, clock.ns + NS_PER_S) == b"done"
    assert wire.finished


def test_a_poll_takes_only_what_is_due_and_a_small_read_leaves_the_rest() -> None:
    clock = ManualClock(50 * NS_PER_S)
    wire = WireReplay(SESSION, clock)
    wire.write(b"ping")
    assert wire.read(10, 0) == b""
    clock.ns += 450 * US
    assert [wire.read(1, 0) for _ in range(3)] == [b"p", b"o", b""]


def test_an_unread_reply_is_still_there_at_the_next_request() -> None:
    clock = ManualClock(50 * NS_PER_S)
    wire = WireReplay(SESSION, clock)
    wire.write(b"ping")
    wire.write(b"more")
    clock.ns += NS_PER_S
    assert [wire.read(10, 0) for _ in range(4)] == [b"po", b"ng", b"done", b""]


def test_discarded_input_is_gone() -> None:
    clock = ManualClock(50 * NS_PER_S)
    wire = WireReplay(SESSION, clock)
    wire.write(b"ping")
    clock.ns += 450 * US
    wire.discard_input()
    assert wire.read(10, clock.ns + NS_PER_S) == b"ng"


def test_what_came_before_any_request_comes_by_itself() -> None:
    clock = ManualClock(50 * NS_PER_S)
    stream = [WireRecord(READ, n * 100_000 * US, bytes([n])) for n in range(5)]
    wire = WireReplay(stream, clock)
    start_ns = clock.ns
    got = [wire.read(100, start_ns + NS_PER_S) for _ in range(5)]
    assert got == [bytes([n]) for n in range(5)]
    assert clock.ns == start_ns + 400_000 * US


def test_another_request_is_an_error_that_shows_both() -> None:
    wire = WireReplay(SESSION, ManualClock(50 * NS_PER_S))
    wire.write(b"ping")
    with pytest.raises(ReplayDiverged) as caught:
        wire.write(b"pink")
    assert str(caught.value) == (
        "record 3: expected the request 0.009000 s write: 6d 6f 72 65; got 70 69 6e 6b; "
        "replay with the settings of the recording"
    )


def test_a_request_beyond_the_end_is_an_error() -> None:
    wire = WireReplay(SESSION, ManualClock(50 * NS_PER_S))
    wire.write(b"ping")
    wire.write(b"more")
    with pytest.raises(ReplayDiverged, match="the recording ended before the request 78"):
        wire.write(b"x")


def test_a_lost_link_is_lost_again_at_its_place() -> None:
    records = [*SESSION[:3], WireRecord(LOST, 1_500 * US, b"adapter gone")]
    clock = ManualClock(50 * NS_PER_S)
    wire = WireReplay(records, clock)
    wire.write(b"ping")
    assert wire.read(10, clock.ns + NS_PER_S) == b"po"
    for act in (lambda: wire.read(10, 0), lambda: wire.write(b"more")):
        with pytest.raises(LinkLost, match="adapter gone"):
            act()


def test_a_recording_without_traffic_is_refused() -> None:
    with pytest.raises(ValueError, match="no byte traffic"):
        WireReplay(SESSION[:1], ManualClock(50 * NS_PER_S))


class TurningServos(ManualClock):
    """Servos whose time is this clock."""

    def __init__(self, specs: Sequence[ServoSpec]) -> None:
        super().__init__(10 * NS_PER_S)
        emulated = [EmulatedServoSpec(id=one.id, model_name=one.model_name) for one in specs]
        self.servos = FreeServos(emulated)
        self.sleep_until(self.ns + NS_PER_S // 100)

    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(deadline_ns)
        self.servos.advance_to(self.ns)


def drive(clock: ManualClock, bus: DynamixelBus) -> np.ndarray:
    """Connect, hold, and follow a sine; return every value that was read."""
    bus.connect()
    positions = [bus.read_state().position_rad.copy()]
    bus.enable_torque()
    for tick in range(60):
        clock.sleep_until(clock.now_ns() + NS_PER_S // 250)
        positions.append(bus.read_state().position_rad.copy())
        bus.write_goals(positions[0] + 0.3 * np.sin(tick / 20))
    return np.array(positions)


def test_a_servo_session_replays_to_the_same_values_without_any_servo(tmp_path: Path) -> None:
    specs = [ServoSpec(id=n, model_name="XM430-W350", joint=f"joint_{n}") for n in (1, 2, 3)]
    bench = TurningServos(specs)
    line = MemoryLine(bench.servos.bank, bench)
    recorder = WireRecorder(tmp_path / "servos.wire", bench)

    def new_bus(
        line: MemoryLine | RecordingTransport | WireReplay, clock: ManualClock
    ) -> DynamixelBus:
        return DynamixelBus(line, clock, specs, baud=1_000_000)

    recorded = drive(bench, new_bus(RecordingTransport(line, recorder), bench))
    assert np.ptp(recorded, axis=0).min() > 0.1, "the servos moved"
    clock = ManualClock(20 * NS_PER_S)
    replay = WireReplay(read_recording(tmp_path / "servos.wire"), clock)
    replayed = drive(clock, new_bus(replay, clock))
    assert np.array_equal(recorded, replayed)
    assert replay.finished


def test_a_driver_with_other_goals_diverges(tmp_path: Path) -> None:
    specs = [ServoSpec(id=1, model_name="XM430-W350", joint="joint_1")]
    bench = TurningServos(specs)
    line = MemoryLine(bench.servos.bank, bench)
    wire = RecordingTransport(line, WireRecorder(tmp_path / "servos.wire", bench))
    drive(bench, DynamixelBus(wire, bench, specs, baud=1_000_000))
    clock = ManualClock(50 * NS_PER_S)
    mirrored = [ServoSpec(id=1, model_name="XM430-W350", joint="joint_1", sign=-1)]
    replay = WireReplay(read_recording(tmp_path / "servos.wire"), clock)
    with pytest.raises(ReplayDiverged, match="expected the request"):
        drive(clock, DynamixelBus(replay, clock, mirrored, baud=1_000_000))
