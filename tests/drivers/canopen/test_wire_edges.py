"""Meet what a real bus does at its edges: reboots, old frames, mute hearts, absurd numbers."""

import math

import can
import numpy as np
import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.canopen.objects import HEARTBEAT_COB, RPDO1, TPDO1, TPDO2
from drivers.errors import NoReply
from drivers.wheel_drives.bus import PowerState
from sim_twin.can import MemoryBus, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

TICK_NS = 4_000_000
LEFT = DriveSpec(node_id=1, joint="left")


class Bench(FreeWheelWorld[WheelDrive]):
    def __init__(self) -> None:
        super().__init__([FreeWheel(WheelDrive(1))])
        self.drive = self.wheels[0].drive
        self.memory_bus = MemoryBus(self.wire)
        self.bus = WheelDriveBus(self.memory_bus, self, [LEFT])

    def run(self, ticks: int, rad_s: float = 0.0) -> None:
        for _ in range(ticks):
            self.state = self.bus.cycle(np.array([rad_s]))
            self.sleep_until(self.now_ns() + TICK_NS)

    def enable(self) -> None:
        self.bus.connect()
        self.bus.enable()
        self.run(10)
        assert self.state.enabled

    def put(self, can_id: int, data: bytes) -> None:
        """Let a frame wait in the host's queue."""
        self.memory_bus.port(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_the_position_goes_on_over_the_end_of_32_bits(bench: Bench) -> None:
    bench.bus.connect()
    per_rad = LEFT.counts_per_rad
    for counts in (0x7FFF_FF00, -0x7FFF_FF00):
        bench.put(TPDO2.cob_base + 1, TPDO2.wire.pack(counts, 0))
    state = bench.bus.cycle(None)
    assert state.position_rad[0] == pytest.approx((0x7FFF_FF00 + 0x200) / per_rad)


def test_a_drive_that_reboots_does_not_move_the_position(bench: Bench) -> None:
    bench.enable()
    bench.run(250, 5.0)
    before_rad = bench.state.position_rad[0]
    assert before_rad > 2.0
    bench.drive.set_supply(on=False)
    bench.drive.set_supply(on=True)
    bench.put(TPDO2.cob_base + 1, TPDO2.wire.pack(0, 0))
    bench.run(5)
    assert bench.state.lost == (True,)
    assert bench.state.position_rad[0] == pytest.approx(before_rad, abs=0.05)


def test_frames_from_before_the_reset_do_not_pass_for_new_ones(bench: Bench) -> None:
    bench.put(HEARTBEAT_COB + 1, b"\x00")
    bench.put(TPDO1.cob_base + 1, TPDO1.wire.pack(0x37, 4000))
    bench.put(TPDO2.cob_base + 1, TPDO2.wire.pack(123456, 0))
    bench.bus.connect()
    bench.run(5)
    assert bench.state.lost == (False,)
    assert bench.state.power_state == (PowerState.SWITCH_ON_DISABLED,)
    assert bench.state.position_rad[0] == pytest.approx(0.0, abs=1e-3)


def test_a_drive_whose_heart_does_not_beat_is_not_connected(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench.drive._producer, "due", lambda now_ns: False)
    with pytest.raises(NoReply, match=r"sends process data and heartbeats.*left \(node 1\).*check"):
        bench.bus.connect()


@pytest.mark.parametrize("rad_s", [1e308, -1e308, 1e12])
def test_the_largest_number_saturates_and_ends_nothing(bench: Bench, rad_s: float) -> None:
    bench.enable()
    targets: list[int] = []

    def listen(frame: can.Message) -> None:
        if frame.arbitration_id == RPDO1.cob_base + 1:
            targets.append(RPDO1.wire.unpack(frame.data)[1])

    bench.wire.attach(listen)
    bench.run(1, rad_s)
    assert targets == [int(math.copysign(2**31 - 1, rad_s))]


def test_a_quick_stop_that_a_drive_holds_ends_without_power_all_the_same(bench: Bench) -> None:
    bench.enable()
    bench.drive._objects.set(0x605A, 0, 6)
    bench.run(100, 3.0)
    bench.bus.quick_stop()
    bench.run(200)
    assert bench.state.power_state == (PowerState.SWITCH_ON_DISABLED,)


def test_a_target_that_stands_while_drives_are_enabled_is_ramped_to(bench: Bench) -> None:
    bench.bus.connect()
    bench.bus.enable()
    fastest = 0.0
    for _ in range(10):
        bench.run(1, 10.0)
        fastest = max(fastest, bench.wheels[0].velocity_rad_s)
    assert bench.state.enabled
    assert 0.0 < fastest < LEFT.acceleration_rad_s2 * 10 * TICK_NS / 1e9


def test_the_hosts_own_node_id_is_refused_for_a_drive() -> None:
    with pytest.raises(ValueError, match="127 is the host's"):
        DriveSpec(node_id=127, joint="left")


def test_a_babbling_bus_holds_no_tick_up_and_hides_no_drive(bench: Bench) -> None:
    bench.enable()
    bench.wire.babble(0x7FF, on=True)
    bench.run(50, 1.0)
    assert bench.state.lost == (False,)
    bench.wire.babble(0x7FF, on=False)
