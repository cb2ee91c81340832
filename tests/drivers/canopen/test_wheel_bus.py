"""What CiA 402 drives do beyond the contract of every drive bus, and the edges of their wire."""

import math
from typing import Any

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.canopen import DriveSpec, PowerState
from drivers.canopen.objects import HEARTBEAT_COB, HEARTBEAT_PRODUCER, RPDO1, TPDO1, TPDO2
from drivers.canopen.wheel_bus import HOST_NODE_ID
from drivers.errors import LinkLost
from drivers.wheel_drives.bus import DriveState

HEARTBEAT_S = 0.1
QUICK_STOP_RAD_S2 = 40.0
STOP_S = 5.0 / QUICK_STOP_RAD_S2 + 0.1
FORWARD = (5.0, 5.0)
LEFT = DriveSpec(node_id=1, joint="left")


def both(state: DriveState, wanted: PowerState) -> bool:
    return state.power_state == (wanted, wanted)


def stands(bench: Any) -> bool:
    return bool(np.abs(bench.velocities).max() < 0.02)


def targets_of(bench: Any, *nodes: int) -> list[int]:
    """Return a list that grows with every target velocity sent to the nodes."""
    targets: list[int] = []

    def listen(frame: can.Message) -> None:
        if frame.arbitration_id - RPDO1.cob_base in nodes:
            targets.append(RPDO1.wire.unpack(frame.data)[1])

    bench.wire.attach(listen)
    return targets


def test_connecting_leaves_the_drives_disabled_with_fresh_values(bench: Any) -> None:
    state = bench.run(0.0)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert np.all(state.age_s <= 0.004)


def test_enabling_walks_the_state_machine_one_state_per_cycle(bench: Any) -> None:
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


def test_position_and_torque_are_those_of_the_wheels(enabled: Any) -> None:
    state = enabled.run(1.0, (4.0, -2.5))
    assert state.velocity_rad_s == pytest.approx(enabled.velocities, abs=0.01)
    positions = [wheel.position_rad for wheel in enabled.wheels]
    assert state.position_rad == pytest.approx(positions, abs=0.03)
    assert state.torque_nm == pytest.approx([0.2, -0.125], abs=0.02)


def test_acceleration_keeps_to_the_configured_ramp(enabled: Any) -> None:
    enabled.run(0.1, (10.0, 10.0))
    assert max(enabled.velocities) <= 20.0 * 0.1
    assert min(enabled.velocities) >= 20.0 * 0.1 * 0.8


def test_a_target_that_stands_while_drives_are_enabled_is_ramped_to(bench: Any) -> None:
    bench.bus.enable()
    fastest = 0.0
    for _ in range(10):
        state = bench.run(0.0, (10.0, 10.0))
        bench.pause(0.004)
        fastest = max(fastest, *bench.velocities)
    assert state.enabled
    assert 0.0 < fastest < LEFT.acceleration_rad_s2 * 10 * 0.004


def test_no_velocity_is_sent_before_all_drives_are_enabled(bench: Any) -> None:
    targets = targets_of(bench, 1, 2)
    bench.drives[1]._on_setpoint = lambda data: None
    bench.bus.enable()
    bench.run(0.2, FORWARD)
    assert bench.drives[0].power_state is PowerState.OPERATION_ENABLED
    assert len(targets) > 50
    assert set(targets) == {0}


@pytest.mark.parametrize("rad_s", [1e308, -1e308, 1e12])
def test_the_largest_number_saturates_on_the_wire(enabled: Any, rad_s: float) -> None:
    targets = targets_of(enabled, 1)
    enabled.run(0.0, (rad_s, 0.0))
    assert targets == [int(math.copysign(2**31 - 1, rad_s))]


def test_disabling_lets_the_wheels_coast(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.disable()
    assert both(enabled.run(0.1, FORWARD), PowerState.SWITCH_ON_DISABLED)
    assert min(enabled.velocities) > 4.0


def test_a_quick_stop_brakes_on_its_ramp_then_takes_the_power_off(enabled: Any) -> None:
    enabled.run(0.6, FORWARD)
    enabled.bus.quick_stop()
    assert both(enabled.run(0.02, FORWARD), PowerState.QUICK_STOP_ACTIVE)
    assert both(enabled.run(STOP_S, FORWARD), PowerState.SWITCH_ON_DISABLED)
    assert stands(enabled)


def test_a_quick_stop_that_a_drive_holds_ends_without_power_all_the_same(enabled: Any) -> None:
    for drive in enabled.drives:
        drive._objects.set(0x605A, 0, 6)
    enabled.run(0.4, FORWARD)
    enabled.bus.quick_stop()
    assert both(enabled.run(0.8), PowerState.SWITCH_ON_DISABLED)


def test_closing_brakes_the_wheels(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.bus.close()
    enabled.pause(STOP_S)
    assert stands(enabled)


def test_when_the_host_falls_silent_the_drives_stop_and_stay_in_fault(enabled: Any) -> None:
    enabled.run(0.6, FORWARD)
    enabled.pause(HEARTBEAT_S + STOP_S)
    assert stands(enabled)
    state = enabled.run(0.5, FORWARD)
    assert both(state, PowerState.FAULT)
    assert stands(enabled)
    assert "heartbeat" in state.fault[0].text


def test_a_drive_that_reboots_is_lost_until_reconnected(enabled: Any) -> None:
    enabled.drives[0].set_supply(on=False)
    enabled.drives[0].set_supply(on=True)
    assert enabled.run(0.5).lost == (True, False)
    enabled.bus.connect()
    assert enabled.run(0.1).healthy


def test_a_drive_that_reboots_does_not_move_the_position(enabled: Any) -> None:
    before_rad = enabled.run(1.0, FORWARD).position_rad[0]
    assert before_rad > 2.0
    enabled.drives[0].set_supply(on=False)
    enabled.drives[0].set_supply(on=True)
    enabled.put(TPDO2.cob_base + 1, TPDO2.wire.pack(0, 0))
    state = enabled.run(0.02)
    assert state.lost == (True, False)
    assert state.position_rad[0] == pytest.approx(before_rad, abs=0.05)


def test_a_drive_that_was_rebooted_and_started_by_others_stays_lost(enabled: Any) -> None:
    enabled.inject(0x000, bytes((0x81, 1)))
    enabled.drives[0]._objects.set(HEARTBEAT_PRODUCER, 0, 25)
    enabled.inject(0x000, bytes((0x01, 1)))
    assert enabled.run(0.5).lost == (True, False)


def test_a_drive_whose_process_data_stop_is_lost_although_its_heart_beats(enabled: Any) -> None:
    enabled.drives[0]._on_sync = lambda: None
    assert not any(enabled.run(HEARTBEAT_S - 0.01).lost)
    assert enabled.run(0.02).lost == (True, False)


def test_a_drive_that_falls_out_of_operation_is_not_enabled_again(enabled: Any) -> None:
    enabled.run(0.5, FORWARD)
    enabled.inject(0x201, RPDO1.wire.pack(0x0000, 0))
    state = enabled.run(0.5, FORWARD)
    assert both(state, PowerState.SWITCH_ON_DISABLED)
    assert state.healthy
    assert abs(enabled.velocities[1]) < 0.02


def test_a_drive_that_leaves_operational_is_lost(enabled: Any) -> None:
    enabled.inject(0x000, bytes((0x80, 2)))
    assert enabled.run(0.05).lost == (False, True)


def test_a_dead_bus_is_a_lost_link(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def down(msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("network is down", 100)

    with monkeypatch.context() as patch:
        patch.setattr(bench.memory_bus, "send", down)
        with pytest.raises(LinkLost, match="network is down"):
            bench.bus.cycle(None)


def test_a_full_transmit_queue_is_counted_and_survived(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(msg: can.Message, timeout: float | None = None) -> None:
        raise can.CanOperationError("Transmit buffer full")

    with monkeypatch.context() as patch:
        patch.setattr(bench.memory_bus, "send", full)
        bench.run(0.2)
    assert bench.bus.counters["dropped"] > 100
    assert bench.run(0.05).healthy


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
    enabled: Any, garbage: list[tuple[int, bytes]]
) -> None:
    boots = {(0x701, 1), (0x702, 1)}
    for can_id, data in garbage:
        if (can_id, len(data)) not in boots:
            enabled.inject(can_id, data)
    state = enabled.run(0.05, (1.0, 1.0))
    assert state.enabled
    assert state.healthy


def test_garbage_of_a_drives_own_frames_is_counted(enabled: Any) -> None:
    before = enabled.bus.counters["malformed"]
    for can_id in (0x181, 0x281, 0x081, 0x701):
        enabled.inject(can_id, b"\x01\x02\x03")
    assert enabled.run(0.01).enabled
    assert enabled.bus.counters["malformed"] == before + 4


def test_a_babbling_bus_holds_no_tick_up_and_hides_no_drive(enabled: Any) -> None:
    enabled.wire.babble(0x7FF, on=True)
    assert enabled.run(0.2, (1.0, 1.0)).lost == (False, False)
    enabled.wire.babble(0x7FF, on=False)


def test_the_position_goes_on_over_the_end_of_32_bits(single: Any) -> None:
    single.bus.connect()
    for counts in (0x7FFF_FF00, -0x7FFF_FF00):
        single.put(TPDO2.cob_base + 1, TPDO2.wire.pack(counts, 0))
    state = single.bus.cycle(None)
    assert state.position_rad[0] == pytest.approx((0x7FFF_FF00 + 0x200) / LEFT.counts_per_rad)


def test_frames_from_before_the_reset_do_not_pass_for_new_ones(single: Any) -> None:
    single.put(HEARTBEAT_COB + 1, b"\x00")
    single.put(TPDO1.cob_base + 1, TPDO1.wire.pack(0x37, 4000))
    single.put(TPDO2.cob_base + 1, TPDO2.wire.pack(123456, 0))
    single.bus.connect()
    state = single.run(0.02, [0.0])
    assert state.lost == (False,)
    assert state.power_state == (PowerState.SWITCH_ON_DISABLED,)
    assert state.position_rad[0] == pytest.approx(0.0, abs=1e-3)
