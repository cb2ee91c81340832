"""The cycle: values on the joint side, partial data when a servo fails, bounded and counted."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.dynamixel import BlockLayout, ServoSpec
from drivers.dynamixel.wire.codec import Instruction
from drivers.errors import LinkLost
from drivers.servo.hardware_error import HardwareError

MakeBench = Callable[..., Any]
FAST_OR_NOT = pytest.mark.parametrize("fast_sync", [True, False])


def connected(make_bench: MakeBench, count: int = 4, **options: Any) -> Any:
    bench = make_bench(count, **options)
    bench.bus.connect()
    bench.cycle()
    return bench


@FAST_OR_NOT
def test_values_are_those_of_the_shafts_on_the_joint_side(
    make_bench: MakeBench, fast_sync: bool
) -> None:
    bench = connected(make_bench, fast_sync=fast_sync)
    shaft_rad = np.array([0.5, -0.5, 1.0, -1.0])
    bench.rotors.position_rad[:] = shaft_rad
    bench.rotors.velocity_rad_s[:] = np.array([-1.0, 2.0, 0.0, 1.0])
    bench.rotors._damping = np.zeros(4)
    bench.cycle()
    state = bench.bus.state
    sign = np.array([1, -1, 1, -1])
    offset = np.array([0.0, 0.1, 0.2, 0.3])
    expected = sign * bench.rotors.position_rad + offset
    assert np.abs(state.position_rad - expected).max() < 0.01
    assert np.abs(state.velocity_rad_s - [-1.0, -2.0, 0.0, -1.0]).max() < 0.03
    assert state.valid.all()
    assert (state.age_s == 0.0).all()
    assert not state.alert.any()


@FAST_OR_NOT
def test_one_cycle_is_one_read_and_one_write(make_bench: MakeBench, fast_sync: bool) -> None:
    bench = connected(make_bench, fast_sync=fast_sync, health_every_cycles=5)
    bench.wire.sent.clear()
    for _ in range(20):
        bench.cycle()
        bench.bus.write_goals(bench.bus.state.position_rad)
    read = Instruction.FAST_SYNC_READ if fast_sync else Instruction.SYNC_READ
    assert bench.wire.count(read) == 20
    assert bench.wire.count(Instruction.SYNC_WRITE) == 20
    assert bench.wire.count(Instruction.READ) == 4
    assert len(bench.wire.sent) == 44


def test_slow_registers_of_all_servos_come_round(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    assert np.isnan(bench.bus.state.voltage_v).all()
    bench.cycle(50)
    assert np.abs(bench.bus.state.voltage_v - 12.0).max() < 0.05
    assert (bench.bus.state.temperature_c > 20).all()
    assert (bench.bus.state.watchdog == 0).all()


@FAST_OR_NOT
def test_a_silent_servo_ages_while_the_others_are_delivered(
    make_bench: MakeBench, fast_sync: bool
) -> None:
    bench = connected(make_bench, fast_sync=fast_sync)
    bench.bank.silence(3)
    bench.cycle(10)
    state = bench.bus.state
    assert state.valid.tolist() == [True, True, False, True]
    assert state.age_s[2] == pytest.approx(0.04)
    assert (state.age_s[[0, 1, 3]] == 0.0).all()
    assert np.isfinite(state.position_rad[2])
    assert bench.bus.counters.suspensions == 1
    assert bench.bus.counters.partial_cycles == 3


def test_several_silent_servos_do_not_mute_the_rest(make_bench: MakeBench) -> None:
    bench = connected(make_bench, 16)
    for servo_id in (2, 3, 9, 16):
        bench.bank.silence(servo_id)
    bench.cycle(20)
    missing = np.flatnonzero(~bench.bus.state.valid) + 1
    assert missing.tolist() == [2, 3, 9, 16]


def test_no_servo_is_suspended_when_the_whole_bus_is_silent(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    for servo_id in (1, 2, 3, 4):
        bench.bank.silence(servo_id)
    bench.cycle(10)
    assert not bench.bus.state.valid.any()
    assert bench.bus.state.age_s.min() == pytest.approx(0.04)
    for servo_id in (1, 2, 3, 4):
        bench.bank.silence(servo_id, silent=False)
    bench.cycle(2)
    assert bench.bus.state.valid.all()


def test_a_servo_never_heard_of_is_infinitely_old(make_bench: MakeBench) -> None:
    bench = make_bench()
    bus = bench.bus
    bus.connect()
    bench.bank.silence(1)
    bus.read_state()
    assert np.isinf(bus.state.age_s[0])
    assert np.isnan(bus.state.position_rad[0])
    assert bus.state.valid[1:].all()


@FAST_OR_NOT
def test_a_corrupt_reply_costs_one_cycle_and_is_counted(
    make_bench: MakeBench, fast_sync: bool
) -> None:
    bench = connected(make_bench, fast_sync=fast_sync)
    bench.bank.corrupt_next(4)
    bench.cycle()
    assert bench.bus.state.valid.tolist() == [True, True, True, False]
    if not fast_sync:
        assert bench.bus.counters.crc_errors == 1
    bench.cycle()
    assert bench.bus.state.valid.all()
    assert bench.bus.counters.suspensions == 0


@FAST_OR_NOT
@given(noise=st.binary(max_size=40), cut=st.integers(0, 400), at=st.integers(0, 400))
@settings(
    max_examples=40,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],  # it is a class, without state
)
def test_no_damage_on_the_wire_raises_or_delivers_a_wrong_value(
    make_bench: MakeBench, fast_sync: bool, noise: bytes, cut: int, at: int
) -> None:
    bench = connected(make_bench, fast_sync=fast_sync, health_every_cycles=1000)
    before = bench.bus.state.copy()

    def damage(reply: bytes) -> bytes:
        spoiled = bytearray(reply)
        spoiled[at % len(spoiled)] ^= 0x10
        return noise + bytes(spoiled[: max(1, cut % len(spoiled))])

    bench.wire.edit = damage
    bench.bus.read_state()
    assert np.array_equal(bench.bus.state.position_rad, before.position_rad)
    assert not bench.bus.state.valid.all()
    bench.wire.edit = lambda reply: reply
    bench.bus.read_state()
    bench.bus.read_state()
    assert bench.bus.state.valid.all()


def test_replies_that_come_a_cycle_late_are_not_taken_for_fresh_ones_for_long(
    make_bench: MakeBench,
) -> None:
    bench = connected(make_bench, fast_sync=False, health_every_cycles=1000)
    held: list[bytes] = []

    def hold_back(reply: bytes) -> bytes:
        held.append(reply)
        return b""

    bench.wire.edit = hold_back
    bench.cycle()
    assert not bench.bus.state.valid.any()
    bench.wire.edit = lambda reply: held.pop(0) + reply if held else reply
    bench.rotors.position_rad[:] = 1.0
    bench.cycle(3)
    expected = np.array([1.0, -0.9, 1.2, -0.7])
    assert np.abs(bench.bus.state.position_rad - expected).max() < 0.01
    assert bench.bus.counters.late >= 1


def test_an_alert_shows_in_the_same_cycle_with_its_cause(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    bench.bank.set_alert(2, HardwareError.OVERLOAD)
    bench.cycle()
    state = bench.bus.state
    assert state.alert.tolist() == [False, True, False, False]
    assert state.error[1] == HardwareError.OVERLOAD
    assert state.faults(bench.specs) == ["servo 2 (joint_2, XM430-W350): overload"]
    assert state.valid.all()


def test_a_reboot_clears_the_alert_and_the_servo_rejoins_without_torque(
    make_bench: MakeBench,
) -> None:
    bench = connected(make_bench)
    bench.bus.enable_torque()
    bench.bank.set_alert(2, HardwareError.OVERLOAD)
    bench.cycle(3)
    bench.bus.reboot(2)
    bench.cycle(2)
    assert not bench.bus.state.valid[1]
    bench.cycle(150)
    state = bench.bus.state
    assert state.valid.all()
    assert not state.alert.any()
    assert state.error[1] == 0
    assert state.torque_on.tolist() == [True, False, True, True]


def test_an_unplugged_bus_says_so_at_once_every_time_and_is_counted_once(
    make_bench: MakeBench,
) -> None:
    bench = connected(make_bench)
    bench.line.unplug()
    with pytest.raises(LinkLost, match="unplugged"):
        bench.bus.read_state()
    bench.line.replug()
    bench.run(0.5)
    with pytest.raises(LinkLost, match="lost before"):
        bench.bus.read_state()
    assert not bench.bus.state.valid.any()
    assert bench.bus.state.age_s == pytest.approx(0.5)
    with pytest.raises(LinkLost, match="lost before"):
        bench.bus.disable_torque()
    assert bench.bus.counters.link_lost == 1
    bus = bench.new_bus()
    bus.connect()
    assert bus.read_state().valid.all()


def test_sixteen_servos_are_read_through_the_usual_path(make_bench: MakeBench) -> None:
    bench = connected(make_bench, 16)
    bench.cycle(100)
    counters = bench.bus.counters
    assert counters.as_dict() == {"cycles": 101} | {
        name: 0 for name in counters.as_dict() if name != "cycles"
    }


def test_a_finger_on_a_rack_is_in_metres(make_bench: MakeBench) -> None:
    finger = ServoSpec(
        id=1, model_name="XC430-W150", joint="gripper", offset_rad=0.023, travel_per_rad=0.012
    )
    bench = connected(make_bench, specs=[finger])
    bench.rotors.position_rad[:] = 1.0
    bench.cycle()
    assert bench.bus.state.position_rad[0] == pytest.approx(0.035, abs=1e-4)
    assert finger.to_joint(finger.to_pulse(0.035)) == pytest.approx(0.035, abs=1e-5)


@pytest.mark.parametrize("layout", [BlockLayout.DIRECT, BlockLayout.INDIRECT])
@pytest.mark.parametrize(
    "cycles",
    [
        pytest.param(2_000, id="short"),
        pytest.param(100_000, id="long", marks=[pytest.mark.slow, pytest.mark.timeout(600)]),
    ],
)
def test_no_cycle_with_stuffed_replies_is_lost(
    make_bench: MakeBench, cycles: int, layout: BlockLayout
) -> None:
    bench = connected(make_bench, 16, fast_sync=False, layout=layout)
    random = np.random.default_rng(20_251)
    bench.rotors._stall_nm[:] = 0.0
    bench.rotors._damping[:] = 0.0
    for cycle in range(cycles):
        if cycle % 500 == 0:
            bench.rotors.velocity_rad_s[:] = random.uniform(-1.5, 0.2, 16)
        bench.cycle()
        assert bench.bus.state.valid.all()
    counters = bench.bus.counters
    assert counters.stuffed > cycles / 100
    assert counters.partial_cycles == counters.timeouts == counters.crc_errors == 0
