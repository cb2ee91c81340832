"""Hold every bus of wheel drives to one contract: what real drives are asked, and what moves."""

from typing import Any

import numpy as np
import pytest

from drivers.errors import DeviceFault, NoReply
from drivers.wheel_drives.bus import DriveBus, PowerState, ResetRule
from sim_twin.contracts.drive_bus import DriveBusContract, DrivePowerContract

FORWARD = (5.0, 5.0)
STOP_S = 1.0


class ReopeningBench:
    """Open the driver of a small world again and again."""

    def __init__(self, bench: Any) -> None:
        self._bench = bench
        self.clock = bench.world

    def open(self) -> DriveBus:
        bus: DriveBus = type(self._bench).on(self._bench.world)
        bus.connect()
        return bus

    def let(self, seconds: float) -> None:
        self._bench.pause(seconds)


@pytest.fixture(params=["cia402", "odrive"])
def drives(request: pytest.FixtureRequest) -> Any:
    """A bench with two drives, of each protocol in turn."""
    return request.getfixturevalue(request.param)


class TestAskedOfRealDrives(DriveBusContract, DrivePowerContract):
    @pytest.fixture
    def bench(self, drives: Any) -> ReopeningBench:
        return ReopeningBench(drives)


@pytest.fixture
def connected(drives: Any) -> Any:
    drives.bus.connect()
    return drives


@pytest.fixture
def enabled(connected: Any) -> Any:
    connected.bus.enable()
    assert connected.run(0.3).enabled
    return connected


def test_connecting_leaves_all_drives_without_power(connected: Any) -> None:
    state = connected.run(0.1)
    assert state.healthy
    assert not state.enabled
    assert connected.powered() == [False, False]


def test_no_step_of_connecting_waits(drives: Any) -> None:
    steps = 0
    for _ in drives.bus.connecting():
        before_ns = drives.world.now_ns()
        steps += 1
        assert drives.world.now_ns() == before_ns
        drives.pause(0.004)
    assert steps >= 1
    assert drives.run(0.1).healthy


def test_reconnecting_starts_over(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.connect()
    state = enabled.run(0.1, FORWARD)
    assert not state.enabled
    assert state.healthy
    assert enabled.powered() == [False, False]


def test_wheels_follow_in_joint_direction(enabled: Any) -> None:
    state = enabled.run(1.0, (4.0, -2.5))
    assert enabled.speeds() == pytest.approx([4.0, -2.5], abs=0.05)
    assert state.velocity_rad_s == pytest.approx([4.0, -2.5], abs=0.05)
    assert state.position_rad[0] > 1.0
    assert state.position_rad[1] < -1.0
    assert np.isfinite(state.torque_nm).all()
    assert state.age_s.max() < 0.03


def test_a_quick_stop_brakes_then_takes_the_power_off(enabled: Any) -> None:
    enabled.run(0.6, FORWARD)
    enabled.bus.quick_stop()
    assert PowerState.QUICK_STOP_ACTIVE in enabled.run(0.02, FORWARD).power_state
    state = enabled.run(STOP_S, FORWARD)
    assert np.abs(enabled.speeds()).max() < 0.1
    assert enabled.powered() == [False, False]
    assert not state.enabled


def test_disabling_takes_the_power_off(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.disable()
    enabled.run(0.2, FORWARD)
    assert enabled.powered() == [False, False]


def test_cutting_the_power_takes_it_off_within_a_tick(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.cut_power()
    enabled.run(0.004, FORWARD)
    assert enabled.powered() == [False, False]
    assert not enabled.run(0.1, FORWARD).enabled


def test_closing_leaves_no_wheel_energised(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.close()
    enabled.pause(STOP_S)
    assert enabled.powered() == [False, False]
    enabled.bus.close()


def test_when_the_host_falls_silent_the_power_goes(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.pause(STOP_S)
    assert enabled.powered() == [False, False]
    state = enabled.run(0.3, FORWARD)
    assert not state.enabled
    assert state.faulted == (True, True)
    assert state.fault[0].rule is ResetRule.AUTOMATIC


def test_a_wait_between_connect_and_the_first_cycle_trips_nothing(connected: Any) -> None:
    connected.pause(2.0)
    assert connected.run(0.3).healthy


def test_a_fault_stops_all_and_needs_reset_and_a_new_enable(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.fail(1)
    state = enabled.run(STOP_S, FORWARD)
    assert state.faulted == (False, True)
    assert state.fault[1].code
    assert state.fault[1].rule is ResetRule.OPERATOR
    assert "over" in state.fault[1].text
    assert enabled.powered() == [False, False]
    enabled.bus.enable()
    assert not enabled.run(0.3, FORWARD).enabled
    assert enabled.bus.reset_fault() == ()
    state = enabled.run(0.3, FORWARD)
    assert state.healthy
    assert not state.enabled
    enabled.bus.enable()
    assert enabled.run(0.3).enabled


def test_a_fault_that_needs_repair_is_not_reset(enabled: Any) -> None:
    enabled.break_down(0)
    enabled.run(0.3)
    (refusal,) = enabled.bus.reset_fault()
    assert "after repair" in refusal
    assert enabled.run(0.6).faulted == (True, False)
    with pytest.raises(DeviceFault, match="after repair"):
        enabled.bus.connect()


def test_a_dead_drive_is_lost_and_the_other_one_is_braked(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.kill(0)
    state = enabled.run(0.15, FORWARD)
    assert state.lost == (True, False)
    assert not state.enabled
    enabled.run(STOP_S, FORWARD)
    assert abs(enabled.speeds()[1]) < 0.1
    assert enabled.powered()[1] is False


def test_a_silent_drive_is_named_with_a_remedy(drives: Any) -> None:
    drives.kill(1)
    with pytest.raises(NoReply, match=r"right \(node \d\).*check"):
        drives.bus.connect()


def test_a_pulled_plug_is_seen_and_stops_the_drives(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.cut_plug()
    state = enabled.run(STOP_S, FORWARD)
    assert state.lost == (True, True)
    assert enabled.powered() == [False, False]


def test_an_absurd_velocity_saturates_at_the_wire(enabled: Any) -> None:
    assert enabled.run(0.02, (1e39, -1e39)).enabled


def test_counters_count_the_traffic(connected: Any) -> None:
    before = connected.bus.counters
    connected.run(0.1)
    after = connected.bus.counters
    assert after["sent"] > before["sent"]
    assert after["received"] > before["received"]
    assert after["malformed"] == 0


def test_a_node_that_answers_now_and_then_is_degraded_then_lost(enabled: Any) -> None:
    enabled.world.wheels[0].drive.silence(on=True)
    seen = set()
    for _ in range(250):
        enabled.world.wheels[0].drive.silence(on=False)
        enabled.run(0.008)
        enabled.world.wheels[0].drive.silence(on=True)
        state = enabled.run(0.04)
        counters = enabled.bus.counters
        seen.add((counters["degraded_nodes"], counters["lost_nodes"]))
        if state.lost[0]:
            break
    assert (1, 0) in seen
    assert state.lost == (True, False)
    assert not enabled.run(0.0).enabled


def test_the_same_run_twice_gives_the_same_bits(enabled: Any) -> None:
    bench = type(enabled)()
    bench.bus.connect()
    bench.bus.enable()
    assert bench.run(0.3).enabled
    for velocity in (3.0, -1.0, 0.5):
        one, two = (each.run(0.1, (velocity, velocity)) for each in (enabled, bench))
        assert one.position_rad.tobytes() == two.position_rad.tobytes()
    bench.bus.close()
