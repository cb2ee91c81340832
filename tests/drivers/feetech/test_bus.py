"""One bus of an arm: setting up, the cycle, torque, and what happens when servos fail."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.errors import DriverError, LinkLost
from drivers.feetech.codec import FeetechInstruction
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import STEP_RAD
from drivers.servo.errors import ServoFault, ServoSilent, WrongServo
from drivers.servo.hardware_error import HardwareError

MakeBench = Callable[..., Any]
SIGN = np.array([1, -1, 1, -1, 1, -1])
OFFSET = np.arange(6) * 0.1


def test_connecting_writes_what_the_driver_needs_so_that_it_outlives_a_power_cut(
    make_bench: MakeBench,
) -> None:
    bench = make_bench(2, eeprom={1: {"operating_mode": 1, "phase": 0x1C}})
    first, second = bench.bus.connect()
    assert first.written == (
        "return_delay_time 250 -> 0",
        "operating_mode 1 -> 0",
        "phase 28 -> 12",
    )
    assert second.written == ("return_delay_time 250 -> 0",)
    bench.bus.reboot(1)
    bench.run(1.0)
    assert bench.bank.register(1, "operating_mode") == 0
    assert bench.bank.register(1, "lock") == 1
    bench.sent.clear()
    assert [setup.written for setup in bench.new_bus().connect()] == [(), ()]
    assert not [packet for packet in bench.sent if packet.params[:1] in (b"\x07", b"\x21", b"\x12")]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model": "STS3250"}, r"expected model 777, got 2825 \(STS3250\); correct the robot file"),
        ({"eeprom": {2: {"firmware_minor": 9}}}, r"firmware 3.10 or newer is needed, got 3.9"),
        ({"supply_v": 5.0, "model": "STS3250"}, r"expected a supply of"),
    ],
)
def test_servos_that_are_not_as_declared_are_named(
    make_bench: MakeBench, options: dict[str, Any], words: str
) -> None:
    declared = [FeetechServo(id=n, model_name="STS3215-C018", joint=f"j{n}") for n in (1, 2)]
    if "supply_v" in options:
        declared = [FeetechServo(id=n, model_name="STS3250", joint=f"j{n}") for n in (1, 2)]
    bench = make_bench(servos=declared, **options)
    with pytest.raises(WrongServo, match=words):
        bench.bus.connect()


def test_servos_of_a_7_v_version_on_12_v_are_refused_before_anything_is_written(
    make_bench: MakeBench,
) -> None:
    bench = make_bench(2, model="STS3215-C001", supply_v=12.0)
    with pytest.raises(WrongServo, match=r"expected a supply of 4 to 8.4 V, got 12.0 V"):
        bench.bus.connect()
    assert bench.count(FeetechInstruction.WRITE) == 0


def test_different_firmware_on_one_bus_is_named(make_bench: MakeBench) -> None:
    bench = make_bench(3, eeprom={3: {"firmware_minor": 11}})
    with pytest.raises(WrongServo, match=r"3.10: shoulder_pan, shoulder_lift; 3.11: elbow_flex"):
        bench.bus.connect()


@pytest.mark.parametrize(("thorough", "named"), [(True, ["1", "3"]), (False, ["1"])])
def test_silent_servos_are_named(make_bench: MakeBench, thorough: bool, named: list[str]) -> None:
    bench = make_bench(3)
    for servo_id in (1, 3):
        bench.bank.silence(servo_id)
    with pytest.raises(ServoSilent) as raised:
        bench.bus.connect(thorough=thorough)
    assert [n for n in "123" if f"servo {n} " in str(raised.value)] == named


def test_values_are_those_of_the_shafts_on_the_joint_side(bench: Any) -> None:
    shaft_rad = np.array([0.5, -0.5, 1.0, -1.0, 0.0, 2.0])
    bench.rotors.position_rad[:] = shaft_rad
    bench.rotors.velocity_rad_s[:] = 0.0
    bench.cycle()
    state = bench.bus.state
    assert np.abs(state.position_rad - (SIGN * shaft_rad + OFFSET)).max() < 0.002
    assert state.valid.all()
    assert (state.age_s == 0).all()
    assert state.voltage_v == pytest.approx(np.full(6, 12.0), abs=0.11)
    assert state.temperature_c == pytest.approx(np.full(6, 25.0), abs=1.0)
    assert not state.torque_on.any()


def test_a_homing_offset_of_other_software_is_part_of_what_a_servo_shows(
    make_bench: MakeBench,
) -> None:
    bench = make_bench(2, eeprom={1: {"homing_offset": -300}, 2: {"homing_offset": 500}})
    shaft_rad = np.array([-300, 500]) * STEP_RAD  # the middle, as LeRobot has calibrated it
    bench.rotors.position_rad[:] = shaft_rad
    bench.run(0.1)
    bench.bus.connect()
    bench.cycle()
    assert bench.bus.state.position_rad == pytest.approx([0.0, 0.1], abs=0.002)
    bench.bus.enable_torque()
    bench.bus.write_goals(np.array([0.2, 0.3]))
    bench.cycle(200)
    assert bench.bus.state.position_rad == pytest.approx([0.2, 0.3], abs=0.02)
    assert bench.bank.register(1, "homing_offset") == -300


def test_an_open_lock_is_closed_and_gains_are_not_burnt_in(make_bench: MakeBench) -> None:
    bench = make_bench(1, eeprom={1: {"position_p_gain": 16, "return_delay_time": 0}})
    link = bench.open().link
    link.write(bench.specs[0], "lock", 0)
    assert bench.bus.connect()[0].written == ()
    assert bench.bank.register(1, "lock") == 1
    link.write(bench.specs[0], "lock", 0)  # by another program, meanwhile
    bench.bus.enable_torque()
    assert bench.bank.register(1, "position_p_gain") == 32
    bench.bus.reboot(1)
    bench.run(1.0)
    assert bench.bank.register(1, "position_p_gain") == 16


def test_a_servo_outside_its_own_limits_is_not_armed(make_bench: MakeBench) -> None:
    limits = {"min_position_limit": 1000, "max_position_limit": 3000}
    bench = make_bench(2, eeprom={2: limits})
    bench.rotors.position_rad[1] = (3500 - 2048) * STEP_RAD
    bench.run(0.1)
    bench.bus.connect()
    before = bench.rotors.position_rad.copy()
    with pytest.raises(ServoFault, match=r"stands at 3500, outside its own .* 1000\.\.3000"):
        bench.bus.enable_torque()
    bench.cycle(100)
    assert np.abs(bench.rotors.position_rad - before).max() < 0.001
    assert not bench.bus.state.torque_on.any()


def test_torque_of_another_program_is_not_taken_for_our_own(make_bench: MakeBench) -> None:
    bench = make_bench(2, eeprom={1: {"return_delay_time": 0}, 2: {"return_delay_time": 0}})
    link = bench.open().link
    for name, value in (("torque_limit", 100), ("acceleration", 20), ("torque_enable", 1)):
        link.write(bench.specs[0], name, value)
    bench.bus.connect()
    assert bench.bus.state.torque_on.tolist() == [True, False]
    assert bench.bus.state.watchdog.tolist() == [0, 0]
    bench.bus.enable_torque()
    assert bench.bus.state.watchdog.tolist() == [1, 1]
    assert bench.bank.register(1, "torque_limit") == 1000
    assert bench.bank.register(1, "acceleration") == 0


def test_every_servo_is_looked_after_while_one_is_away(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.silence(6)
    bench.cycle(30)
    for servo in bench.specs[:5]:
        bench.open().link.write(servo, "torque_enable", 0)
    bench.cycle(250)
    assert not bench.bus.state.torque_on[:5].any()


def test_all_that_were_away_come_back_although_the_first_does_not(bench: Any) -> None:
    for servo_id in (2, 3, 4, 5):
        bench.bank.silence(servo_id)
    bench.cycle(60)
    for servo_id in (3, 4, 5):
        bench.bank.silence(servo_id, silent=False)
    bench.cycle(600)
    assert bench.bus.state.valid.tolist() == [True, False, True, True, True, True]


def test_one_cycle_is_one_read_and_one_write(bench: Any) -> None:
    bench.sent.clear()
    for _ in range(20):
        bench.cycle()
        bench.bus.write_goals(bench.bus.state.position_rad)
    assert bench.count(FeetechInstruction.SYNC_READ) == 20
    assert bench.count(FeetechInstruction.SYNC_WRITE) == 20
    assert bench.count(FeetechInstruction.READ) == 4


def test_goals_are_reached_rounded_and_clamped(bench: Any) -> None:
    bench.bus.enable_torque()
    goals = np.array([0.4, -0.3, 9.0, 0.1, -0.2, 0.6])
    bench.bus.write_goals(goals)
    bench.cycle(250)
    sent = bench.bus.sent_goals
    assert np.abs(sent - goals)[[0, 1, 3, 4, 5]].max() < 0.001
    assert sent[2] == pytest.approx(np.pi + 0.2, abs=0.01), "the servo's own limit"
    state = bench.bus.state
    assert np.abs(state.position_rad - goals)[[0, 1, 3, 4, 5]].max() < 0.02
    assert state.torque_on.all()


@pytest.mark.parametrize("goals", [np.zeros(5), np.array([0, 0, np.nan, 0, 0, 0])])
def test_goals_that_make_no_sense_are_refused_and_none_is_sent(bench: Any, goals: Any) -> None:
    bench.sent.clear()
    with pytest.raises(ValueError, match=r"6 goals|elbow_flex"):
        bench.bus.write_goals(goals)
    assert not bench.sent


def test_torque_comes_without_a_jump_to_an_old_goal(bench: Any) -> None:
    bench.bus.write_goals(np.full(6, 1.0))  # stays in the servos, whose torque is off
    before = bench.rotors.position_rad.copy()
    bench.bus.enable_torque()
    bench.cycle(100)
    assert np.abs(bench.rotors.position_rad - before).max() < 0.01
    assert bench.bus.state.torque_on.all()


def test_torque_off_is_tried_everywhere_and_failures_are_returned(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.silence(3)
    failures = bench.bus.disable_torque()
    assert list(failures) == [3]
    assert bench.bus.state.torque_on.tolist() == [False, False, True, False, False, False]


def test_effort_is_limited_once_and_only_where_it_changes(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.sent.clear()
    assert bench.bus.limit_effort({6: 0.4}) == {}
    assert bench.bus.limit_effort({6: 0.4}) == {}
    assert bench.bank.register(6, "torque_limit") == 400
    assert bench.count(FeetechInstruction.WRITE) == 1
    with pytest.raises(ValueError, match=r"within 0\.\.1"):
        bench.bus.limit_effort({6: 1.2})


def test_an_error_is_told_with_valid_data_and_decided_about(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.set_alert(2, HardwareError.OVERLOAD)
    bench.cycle(3)
    state = bench.bus.state
    assert state.valid.all()
    assert state.error.tolist() == [0, int(HardwareError.OVERLOAD), 0, 0, 0, 0]
    (decision,) = bench.bus.journal.take_decisions()
    assert decision.joint == "shoulder_lift"
    with pytest.raises(ServoFault, match="overload; remove the cause"):
        bench.bus.enable_torque([2])


def test_a_servo_that_was_rebooted_comes_back_without_torque_and_rejoins(bench: Any) -> None:
    bench.bus.enable_torque()
    bench.bank.set_alert(2, HardwareError.OVERLOAD)
    bench.cycle(3)
    bench.bus.reboot(2)
    bench.cycle(50)
    assert not bench.bus.state.valid[1]
    assert bench.bus.state.valid[[0, 2, 3, 4, 5]].all()
    bench.cycle(400)
    state = bench.bus.state
    assert state.valid.all()
    assert state.error[1] == 0
    assert not state.torque_on[1]
    assert any("servo 2" in one and "torque is off" in one for one in bench.bus.notices)
    bench.bus.enable_torque([2])


def test_a_silent_servo_costs_the_others_nothing(bench: Any) -> None:
    bench.bank.silence(4)
    bench.cycle()
    state = bench.bus.state
    assert state.valid.tolist() == [True, True, True, False, True, True]
    bench.cycle(10)
    assert state.age_s[3] == pytest.approx(0.044, abs=0.01)
    assert (state.age_s[[0, 1, 2, 4, 5]] == 0).all()
    assert bench.bus.counters.suspensions == 1
    bench.bank.silence(4, silent=False)
    bench.cycle(200)
    assert bench.bus.state.valid.all()
    assert bench.bus.counters.returns == 1


SPOILERS = ("garble", "truncate", "duplicate", "set_clash", "set_wrong_baud")


@pytest.mark.parametrize("fault", SPOILERS)
def test_a_servo_that_spoils_the_wire_is_not_believed(bench: Any, fault: str) -> None:
    bench.rotors.position_rad[:] = 0.25
    bench.cycle()
    good = bench.bus.state.position_rad.copy()
    getattr(bench.bank, fault)(3)
    for _ in range(30):
        bench.cycle()
        state = bench.bus.state
        assert np.abs(state.position_rad - good)[state.valid].max() < 0.01
        assert state.valid[[0, 1]].all()


def test_an_adapter_that_hears_itself_is_no_fault(make_bench: MakeBench) -> None:
    bench = make_bench(3)
    bench.bank.set_echo()
    bench.bus.connect()
    bench.cycle(5)
    assert bench.bus.state.valid.all()


def test_values_grow_old_when_the_adapter_goes(bench: Any) -> None:
    def gone(*_: object) -> bytes:
        raise LinkLost("unplugged")

    bench.line.write = gone
    with pytest.raises(LinkLost):
        bench.bus.read_state()
    assert not bench.bus.state.valid.any()
    bench.run(0.1)
    with pytest.raises(LinkLost, match="lost before"):
        bench.bus.read_state()
    assert (bench.bus.state.age_s > 0.09).all()


def test_scs_servos_are_read_one_by_one_high_byte_first(make_bench: MakeBench) -> None:
    bench = make_bench(2, model="SCS0009", supply_v=6.0)
    bench.bus.connect()
    bench.rotors.position_rad[:] = [0.2, -0.3]
    bench.cycle()
    assert bench.bus.state.position_rad == pytest.approx([0.2, 0.3 + 0.1], abs=0.01)
    assert bench.count(FeetechInstruction.SYNC_READ) == 0
    bench.bus.enable_torque()
    bench.bus.write_goals(np.array([0.4, 0.2]))
    bench.cycle(200)
    assert bench.bus.state.position_rad == pytest.approx([0.4, 0.2], abs=0.03)
    assert bench.bus.limit_effort({1: 1.0}) == {}
    assert "no torque limit" in str(bench.bus.limit_effort({1: 0.5})[1])


def test_a_bus_that_cannot_be_is_refused(make_bench: MakeBench) -> None:
    one = FeetechServo(id=1, model_name="STS3250", joint="a")
    for servos, words in (
        ([], "at least one"),
        ([one, FeetechServo(id=1, model_name="STS3250", joint="b")], "own id"),
        ([one, FeetechServo(id=2, model_name="SCS0009", joint="b")], "one kind"),
    ):
        with pytest.raises(ValueError, match=words):
            make_bench(1).bus.__class__(None, make_bench(1), servos, baud=1_000_000)
    with pytest.raises(DriverError, match="not connected"):
        make_bench(1).bus.read_state()
