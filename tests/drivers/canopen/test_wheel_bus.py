"""Step driver, emulated drives and free wheels in lock-step."""

from collections.abc import Iterator

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.canopen import DriveSpec, PowerState, WheelDriveBus
from drivers.canopen.objects import HEARTBEAT_PRODUCER, RPDO1
from drivers.canopen.wheel_bus import HOST_NODE_ID
from drivers.errors import LinkLost
from drivers.wheel_drives.bus import DriveState
from sim_twin.can import MemoryBus, MotorMounting, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

TICK_NS = 4_000_000
HEARTBEAT_S = 0.1
QUICK_STOP_RAD_S2 = 40.0
FORWARD = (5.0, 5.0)


class Bench(FreeWheelWorld[WheelDrive]):
    """Two drives, the right one mounted mirrored, and the driver."""

    def __init__(self) -> None:
        super().__init__(
            [FreeWheel(WheelDrive(1)), FreeWheel(WheelDrive(2, MotorMounting(sign=-1)))]
        )
        self.left, self.right = (wheel.drive for wheel in self.wheels)
        self.memory_bus = MemoryBus(self.wire)
        self.bus = WheelDriveBus(
            self.memory_bus,
            self,
            [
                DriveSpec(node_id=1, joint="left_wheel"),
                DriveSpec(node_id=2, joint="right_wheel", sign=-1),
            ],
            HEARTBEAT_S,
        )

    @property
    def velocities(self) -> list[float]:
        return [wheel.velocity_rad_s for wheel in self.wheels]

    def pause(self, duration_s: float) -> None:
        self.sleep_until(self.now_ns() + round(duration_s * 1e9))

    def run(self, duration_s: float, velocity: tuple[float, float] | None = None) -> DriveState:
        wanted = None if velocity is None else np.array(velocity)
        state = self.bus.cycle(wanted)
        for _ in range(round(duration_s * 1e9) // TICK_NS):
            self.sleep_until(self.now_ns() + TICK_NS)
            state = self.bus.cycle(wanted)
        return state

    def inject(self, can_id: int, data: bytes) -> None:
        with MemoryBus(self.wire) as outsider:
            outsider.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    bench.bus.connect()
    yield bench
    bench.bus.close()


@pytest.fixture
def enabled(bench: Bench) -> Bench:
    bench.bus.enable()
    assert bench.run(0.05).enabled
    return bench


def both(state: DriveState, wanted: PowerState) -> bool:
    return state.power_state == (wanted, wanted)


def test_connecting_leaves_the_drives_disabled_with_fresh_values(bench: Bench) -> None:
    state = bench.run(0.0)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert state.healthy
    assert not state.enabled
    assert np.all(state.age_s <= 0.004)


def test_enabling_walks_the_state_machine_one_state_per_cycle(bench: Bench) -> None:
    bench.bus.enable()
    seen = [bench.run(0.0).power_state[0]]
    for _ in range(3):
        bench.pause(0.004)
        seen.append(bench.run(0.0).power_state[0])
    assert seen == [
        PowerState.SWITCH_ON_DISABLED,
        PowerState.READY_TO_SWITCH_ON,
        PowerState.SWITCHED_ON,
        PowerState.OPERATION_ENABLED,
    ]
    assert bench.bus.enabled


def test_enabling_turns_no_wheel(bench: Bench) -> None:
    bench.bus.enable()
    bench.run(0.3)
    assert bench.velocities == [0.0, 0.0]


def test_wheels_follow_their_velocities_in_joint_direction(enabled: Bench) -> None:
    state = enabled.run(1.0, (4.0, -2.5))
    assert enabled.velocities == pytest.approx([4.0, -2.5], abs=0.02)
    assert state.velocity_rad_s == pytest.approx(enabled.velocities, abs=0.01)
    positions = [wheel.position_rad for wheel in enabled.wheels]
    assert state.position_rad == pytest.approx(positions, abs=0.03)
    assert state.torque_nm == pytest.approx([0.2, -0.125], abs=0.02)


def test_acceleration_keeps_to_the_configured_ramp(enabled: Bench) -> None:
    enabled.run(0.1, (10.0, 10.0))
    assert max(enabled.velocities) <= 20.0 * 0.1
    assert min(enabled.velocities) >= 20.0 * 0.1 * 0.8


def test_no_velocity_is_sent_before_all_drives_are_enabled(bench: Bench) -> None:
    targets: list[int] = []

    def listen(frame: can.Message) -> None:
        if frame.arbitration_id in (0x201, 0x202):
            targets.append(RPDO1.wire.unpack(frame.data)[1])

    bench.wire.attach(listen)
    bench.right._on_setpoint = lambda data: None  # type: ignore[method-assign]
    bench.bus.enable()
    bench.run(0.2, FORWARD)
    assert bench.left.power_state is PowerState.OPERATION_ENABLED
    assert len(targets) > 50
    assert set(targets) == {0}


def test_disabling_lets_the_wheels_coast(enabled: Bench) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.disable()
    state = enabled.run(0.1, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert min(enabled.velocities) > 4.0


def test_a_quick_stop_brakes_on_its_ramp_then_takes_the_power_off(enabled: Bench) -> None:
    enabled.run(0.6, FORWARD)
    enabled.bus.quick_stop()
    state = enabled.run(0.02, FORWARD)
    assert both(state, PowerState.QUICK_STOP_ACTIVE)
    state = enabled.run(5.0 / QUICK_STOP_RAD_S2 + 0.1, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert np.abs(enabled.velocities).max() < 0.02
    assert not state.enabled


def test_when_the_host_falls_silent_the_drives_stop_and_stay_in_fault(enabled: Bench) -> None:
    enabled.run(0.6, FORWARD)
    enabled.pause(HEARTBEAT_S + 5.0 / QUICK_STOP_RAD_S2 + 0.1)
    assert np.abs(enabled.velocities).max() < 0.02
    state = enabled.run(0.5, FORWARD)
    assert both(state, PowerState.FAULT)
    assert np.abs(enabled.velocities).max() < 0.02
    assert state.fault[0] is not None
    assert "heartbeat" in state.fault[0].text


def test_a_fault_needs_reset_and_a_new_enable(enabled: Bench) -> None:
    enabled.pause(0.4)
    enabled.run(0.1)
    enabled.bus.enable()
    assert both(enabled.run(0.1, FORWARD), PowerState.FAULT)
    enabled.bus.reset_fault()
    state = enabled.run(0.1, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert state.fault == (None, None)
    assert not state.enabled
    enabled.bus.enable()
    assert enabled.run(0.5, FORWARD).enabled
    assert min(enabled.velocities) > 1.0


def test_a_restarted_driver_starts_disabled(enabled: Bench) -> None:
    enabled.run(0.3, FORWARD)
    enabled.pause(0.5)
    enabled.bus.connect()
    state = enabled.run(0.2, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert state.healthy


def test_a_driver_that_ticks_on_never_trips_the_watch(enabled: Bench) -> None:
    assert enabled.run(3.0, FORWARD).enabled


def test_a_long_wait_between_connect_and_the_first_cycle_trips_nothing(bench: Bench) -> None:
    bench.pause(2.0)
    state = bench.run(0.0)
    assert state.healthy
    assert both(state, PowerState.SWITCH_ON_DISABLED)


def test_a_dead_drive_is_seen_and_the_other_one_is_braked(enabled: Bench) -> None:
    enabled.run(0.6, FORWARD)
    enabled.left.set_supply(on=False)
    state = enabled.run(HEARTBEAT_S + 0.02, FORWARD)
    assert state.lost == (True, False)
    assert not state.enabled
    assert state.age_s[0] > HEARTBEAT_S
    enabled.run(0.3, FORWARD)
    assert abs(enabled.velocities[1]) < 0.02


def test_a_drive_that_reboots_in_between_is_lost_until_connected_anew(enabled: Bench) -> None:
    enabled.left.set_supply(on=False)
    enabled.left.set_supply(on=True)
    assert enabled.run(0.5).lost == (True, False)
    enabled.bus.connect()
    assert enabled.run(0.1).healthy


def test_a_drive_that_was_rebooted_and_started_by_others_stays_lost(enabled: Bench) -> None:
    enabled.inject(0x000, bytes((0x81, 1)))
    enabled.left._objects.set(HEARTBEAT_PRODUCER, 0, 25)
    enabled.inject(0x000, bytes((0x01, 1)))
    assert enabled.run(0.5).lost == (True, False)


def test_a_drive_whose_process_data_stop_is_lost_although_its_heart_beats(enabled: Bench) -> None:
    enabled.left._on_sync = lambda: None  # type: ignore[method-assign]
    assert not any(enabled.run(HEARTBEAT_S - 0.01).lost)
    assert enabled.run(0.02).lost == (True, False)


def test_a_drive_that_falls_out_of_operation_is_not_enabled_again(enabled: Bench) -> None:
    enabled.run(0.5, FORWARD)
    enabled.inject(0x201, RPDO1.wire.pack(0x0000, 0))
    state = enabled.run(0.5, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert state.healthy
    assert abs(enabled.velocities[1]) < 0.02


def test_a_drive_that_leaves_operational_is_lost(enabled: Bench) -> None:
    enabled.inject(0x000, bytes((0x80, 2)))
    assert enabled.run(0.05).lost == (False, True)


def test_a_faulted_drive_takes_the_other_one_with_it(enabled: Bench) -> None:
    enabled.run(0.5, FORWARD)
    enabled.right.raise_fault(0x4310, 0x09)
    state = enabled.run(0.3, FORWARD)
    assert state.power_state == (PowerState.SWITCH_ON_DISABLED, PowerState.FAULT)
    assert state.faulted == (False, True)
    assert state.fault[1] is not None
    assert state.fault[1].text == "0x4310 drive over-temperature"
    assert np.abs(enabled.velocities).max() < 0.02


def test_a_pulled_plug_stops_the_drives_and_shows_as_lost(enabled: Bench) -> None:
    enabled.run(0.5, FORWARD)
    enabled.wire.cut = True
    state = enabled.run(0.4, FORWARD)
    assert state.lost == (True, True)
    assert np.abs(enabled.velocities).max() < 0.02
    assert enabled.left.power_state is PowerState.FAULT


def test_a_dead_bus_is_a_lost_link(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def down(msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("network is down", 100)

    monkeypatch.setattr(bench.memory_bus, "send", down)
    with pytest.raises(LinkLost, match="network is down"):
        bench.bus.cycle(None)


def test_a_full_transmit_queue_is_counted_and_survived(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("Transmit buffer full")

    with monkeypatch.context() as patch:
        patch.setattr(bench.memory_bus, "send", full)
        bench.run(0.2)
    assert bench.bus.counters["dropped"] > 100
    assert bench.run(0.05).healthy


def test_closing_brakes_the_wheels(enabled: Bench) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.close()
    enabled.pause(5.0 / QUICK_STOP_RAD_S2 + 0.05)
    assert np.abs(enabled.velocities).max() < 0.02


def test_a_velocity_that_is_no_number_is_refused(enabled: Bench) -> None:
    with pytest.raises(ValueError, match="NaN"):
        enabled.bus.cycle(np.array([np.nan, 0.0]))


def test_an_absurd_velocity_saturates_at_the_wire(enabled: Bench) -> None:
    assert enabled.run(0.02, (1e12, -1e12)).enabled


HOST_IDS = {0x000, 0x080, 0x201, 0x202, 0x601, 0x602, 0x700 + HOST_NODE_ID}


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    garbage=st.lists(
        st.tuples(st.integers(0, 0x7FF).filter(lambda i: i not in HOST_IDS), st.binary(max_size=5)),
        max_size=40,
    )
)
def test_short_garbage_frames_disturb_neither_side(
    enabled: Bench, garbage: list[tuple[int, bytes]]
) -> None:
    boots = {(0x701, 1), (0x702, 1)}
    for can_id, data in garbage:
        if (can_id, len(data)) not in boots:
            enabled.inject(can_id, data)
    state = enabled.run(0.05, (1.0, 1.0))
    assert state.enabled
    assert state.healthy


def test_garbage_of_a_drives_own_frames_is_counted(enabled: Bench) -> None:
    before = enabled.bus.counters["malformed"]
    for can_id in (0x181, 0x281, 0x081, 0x701):
        enabled.inject(can_id, b"\x01\x02\x03")
    assert enabled.run(0.01).enabled
    assert enabled.bus.counters["malformed"] == before + 4


def test_the_same_run_twice_gives_the_same_bits() -> None:
    def trace() -> bytes:
        bench = Bench()
        bench.bus.connect()
        bench.bus.enable()
        states = [bench.run(0.02, (3.0, float(k % 5))) for k in range(20)]
        bench.bus.close()
        return b"".join(state.position_rad.tobytes() for state in states)

    assert trace() == trace()
