"""Torque comes on without a bump and with a watchdog, goals are clamped, refusals are named."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel import WatchdogState
from drivers.dynamixel.errors import RejectedAccess, RejectedLimit, RejectedRange, WatchdogTripped
from drivers.dynamixel.wire.codec import Instruction
from drivers.errors import LinkLost
from drivers.servo.errors import NotKept, ServoFault, ServoSilent
from drivers.servo.hardware_error import HardwareError

MakeBench = Callable[..., Any]


def watchdog_of(bench: Any) -> WatchdogState:
    state: WatchdogState = bench.bus.watchdog
    return state


def shafts(bench: Any) -> np.ndarray:
    position: np.ndarray = bench.rotors.position_rad
    return position.copy()


def test_enabling_holds_the_measured_pose(bench: Any) -> None:
    bench.rotors.position_rad[:] = [0.3, -0.7, 1.1, -1.3]
    bench.run(0.01)
    before = shafts(bench)
    bench.bus.enable_torque()
    assert bench.bus.state.torque_on.all()
    largest = 0.0
    for _ in range(50):
        bench.cycle()
        largest = max(largest, np.abs(shafts(bench) - before).max())
    assert largest < 0.005


def test_goals_move_the_joints_there(bench: Any) -> None:
    bench.cycle()
    bench.bus.enable_torque()
    goal = bench.bus.state.position_rad + 0.4
    for _ in range(250):
        bench.cycle()
        bench.bus.write_goals(goal)
        written = bench.bus.sent_goals
    assert np.abs(written - goal).max() < 0.0008
    assert np.abs(bench.bus.state.position_rad - goal).max() < 0.01


def test_goals_beyond_the_servos_range_are_clamped_and_reported(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bus.write_goals(np.array([100.0, 100.0, -100.0, -100.0]))
    written = bench.bus.sent_goals
    pulses = [bench.bank.register(n, "goal_position") for n in (1, 2, 3, 4)]
    assert pulses == [4095, 0, 0, 4095]
    expected = [spec.to_joint(p) for spec, p in zip(bench.specs, pulses, strict=True)]
    assert written == pytest.approx(expected)


def test_a_goal_that_is_no_number_or_too_few_goals_are_refused(bench: Any) -> None:
    with pytest.raises(ValueError, match="finite, got others for joint_2, joint_4"):
        bench.bus.write_goals(np.array([0.0, np.nan, 0.0, np.inf]))
    with pytest.raises(ValueError, match="expected 4 goals"):
        bench.bus.write_goals(np.zeros(3))
    with pytest.raises(ValueError, match="for joint_1, joint_2"):
        bench.bus.write_goals(np.array([np.inf, -np.inf, 0.0, 0.0]))


def test_the_watchdog_is_armed_with_torque_and_fed_by_the_cycle(bench: Any) -> None:
    assert watchdog_of(bench) is WatchdogState.OFF
    bench.bus.enable_torque()
    assert watchdog_of(bench) is WatchdogState.ARMED
    assert [bench.bank.register(n, "bus_watchdog") for n in (1, 2, 3, 4)] == [5, 5, 5, 5]
    bench.cycle(100)
    assert watchdog_of(bench) is WatchdogState.ARMED


def test_silence_trips_the_watchdog_until_it_is_cleared_explicitly(
    bench: Any,
) -> None:
    bench.bus.enable_torque()
    bench.cycle(5)
    bench.run(0.2)
    bench.cycle()
    assert watchdog_of(bench) is WatchdogState.TRIPPED
    assert bench.bus.watchdog_tripped == ("joint_1", "joint_2", "joint_3", "joint_4")
    with pytest.raises(RejectedRange, match="clear the Bus Watchdog"):
        bench.bus.write_register(1, "goal_position", 2048)
    with pytest.raises(WatchdogTripped, match="clear the watchdog, then enable"):
        bench.bus.enable_torque()
    bench.bus.clear_watchdog()
    assert watchdog_of(bench) is WatchdogState.CLEARED
    assert bench.bus.watchdog_tripped == ()
    bench.bus.enable_torque()
    assert watchdog_of(bench) is WatchdogState.ARMED
    bench.bus.write_register(1, "goal_position", 2048)


def test_torque_off_ends_the_watch(bench: Any) -> None:
    bench.bus.enable_torque()
    assert bench.bus.disable_torque() == {}
    assert watchdog_of(bench) is WatchdogState.OFF
    assert not bench.bus.state.torque_on.any()
    bench.run(0.3)
    bench.cycle()
    assert watchdog_of(bench) is WatchdogState.OFF


def test_torque_off_tries_every_servo_and_returns_failures(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.silence(2)
    failures = bench.bus.disable_torque()
    assert list(failures) == [2]
    assert isinstance(failures[2], ServoSilent)
    assert [bench.bank.register(n, "torque_enable") for n in (1, 2, 3, 4)] == [0, 1, 0, 0]
    assert bench.bus.state.torque_on.tolist() == [False, True, False, False]
    assert watchdog_of(bench) is WatchdogState.ARMED


def test_torque_off_works_while_a_servo_alerts(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.set_alert(3, HardwareError.ENCODER)
    assert bench.bus.disable_torque() == {}


def test_a_servo_with_a_hardware_error_is_not_enabled_nor_are_the_others(bench: Any) -> None:
    bench.bank.set_alert(3, HardwareError.OVERHEATING)
    with pytest.raises(ServoFault, match=r"servo 3 .*overheating.*reboot"):
        bench.bus.enable_torque()
    assert [bench.bank.register(n, "torque_enable") for n in (1, 2, 3, 4)] == [0, 0, 0, 0]


def test_a_failure_half_way_switches_everything_off_again(bench: Any) -> None:
    bench.bus.write_register(3, "max_position_limit", 1000)
    bench.bus.write_register(3, "min_position_limit", 0)
    bench.rotors.position_rad[:] = np.pi / 4
    bench.run(0.01)
    with pytest.raises(NotKept, match=r"servo 3 .*goal_position expected 2560, got"):
        bench.bus.enable_torque()
    assert [bench.bank.register(n, "torque_enable") for n in (1, 2, 3, 4)] == [0, 0, 0, 0]
    assert watchdog_of(bench) is WatchdogState.OFF


def test_a_failure_half_way_lets_none_go_that_held_before(bench: Any) -> None:
    bench.bus.write_register(3, "max_position_limit", 1000)
    bench.bus.write_register(3, "min_position_limit", 0)
    bench.rotors.position_rad[:] = np.pi / 4
    bench.run(0.01)
    bench.bus.enable_torque([1, 2])
    with pytest.raises(NotKept, match="servo 3"):
        bench.bus.enable_torque()
    assert [bench.bank.register(n, "torque_enable") for n in (1, 2, 3, 4)] == [1, 1, 0, 0]


def test_chosen_servos_alone_are_enabled(bench: Any) -> None:
    bench.bus.enable_torque([1, 4])
    assert bench.bus.state.torque_on.tolist() == [True, False, False, True]
    with pytest.raises(ValueError, match=r"no servo \[9\] on this bus"):
        bench.bus.enable_torque([9])


def test_a_pwm_limit_goes_on_the_wire_only_when_it_changes(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.wire.sent.clear()
    for _ in range(5):
        assert bench.bus.limit_effort({4: 0.4}) == {}
    assert bench.wire.count(Instruction.WRITE) == 1
    assert bench.bank.register(4, "goal_pwm") == 354
    bench.bus.limit_effort({4: 1.0})
    assert bench.bank.register(4, "goal_pwm") == 885
    with pytest.raises(ValueError, match=r"within 0\.\.1"):
        bench.bus.limit_effort({4: 1.2})
    with pytest.raises(ValueError, match="no servo 9"):
        bench.bus.limit_effort({9: 0.2})


def test_a_pwm_limit_that_was_not_accepted_is_reported_and_sent_again(bench: Any) -> None:
    bench.bank.silence(4)
    assert list(bench.bus.limit_effort({4: 0.4})) == [4]
    bench.bank.silence(4, silent=False)
    assert bench.bus.limit_effort({4: 0.4}) == {}
    assert bench.bank.register(4, "goal_pwm") == 354


def test_registers_are_read_and_written_by_name(bench: Any) -> None:
    bench.bus.write_register(1, "position_p_gain", 900)
    assert bench.bus.read_register(1, "position_p_gain") == 900
    assert bench.bus.read_register(1, "model_number") == 1120


def test_refusals_are_named_by_their_reason(bench: Any) -> None:
    bench.bus.enable_torque()
    with pytest.raises(RejectedAccess, match=r"servo 1 .*EEPROM only while torque is off"):
        bench.bus.write_register(1, "operating_mode", 1)
    with pytest.raises(RejectedRange, match="position_p_gain = 20000"):
        bench.bus.write_register(1, "position_p_gain", 20_000)
    with pytest.raises(RejectedLimit, match="limit registers"):
        bench.bus.write_register(1, "goal_velocity", 1000)
    with pytest.raises(ValueError, match="read-only"):
        bench.bus.write_register(1, "present_position", 0)
    with pytest.raises(ValueError, match="must fit in 1 bytes"):
        bench.bus.write_register(1, "led", 300)
    with pytest.raises(ValueError, match=r"no register 'presence'; it has model_number"):
        bench.bus.read_register(1, "presence")
    with pytest.raises(ValueError, match="no register 'goal_current'"):
        bench.bus.read_register(3, "goal_current")


def test_a_silent_servo_is_asked_again_and_then_named(bench: Any) -> None:
    bench.bank.silence(1)
    with pytest.raises(ServoSilent, match="no answer in 3 attempts"):
        bench.bus.read_register(1, "led")
    assert bench.bus.counters.retries == 2
    bench.bank.silence(1, silent=False)
    bench.bank.corrupt_next(1)
    assert bench.bus.read_register(1, "led") == 0
    assert bench.bus.counters.crc_errors == 1


def after_replies(bench: Any, count: int, act: Callable[[], None]) -> None:
    """Call `act` once the bus has sent `count` replies."""
    sent = 0

    def pass_on(reply: bytes) -> bytes:
        nonlocal sent
        sent += 1
        if sent == count:
            act()
        return reply

    bench.wire.edit = pass_on


@pytest.mark.parametrize("replies", [1, 2, 3])
def test_a_servo_that_falls_silent_while_enabling_leaves_the_others_off(
    bench: Any, replies: int
) -> None:
    after_replies(bench, replies, lambda: bench.bank.silence(2))
    with pytest.raises(ServoSilent, match=r"no answer from servo 2 \(joint_2"):
        bench.bus.enable_torque()
    assert [bench.bank.register(n, "torque_enable") for n in (1, 3, 4)] == [0, 0, 0]
    assert bench.bus.watchdog is not WatchdogState.ARMED


@pytest.mark.parametrize("replies", [1, 2, 3, 4])
def test_unplugging_while_enabling_is_a_lost_link_and_no_motor_runs_unwatched(
    bench: Any, replies: int
) -> None:
    after_replies(bench, replies, bench.line.unplug)
    with pytest.raises(LinkLost):
        bench.bus.enable_torque()
        bench.bus.read_state()
    for servo_id in (1, 2, 3, 4):
        on = bench.bank.register(servo_id, "torque_enable")
        assert not on or bench.bank.register(servo_id, "bus_watchdog") == 5


def test_enabling_takes_few_transactions_however_many_servos(make_bench: MakeBench) -> None:
    bench = make_bench(16)
    bench.bus.connect()
    bench.wire.sent.clear()
    bench.bus.enable_torque()
    assert len(bench.wire.sent) <= 10
    bench.wire.sent.clear()
    bench.bus.disable_torque()
    assert len(bench.wire.sent) == 2
