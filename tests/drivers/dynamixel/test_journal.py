import pytest

from drivers.dynamixel import DynamixelBus
from drivers.servo.fault_policy import FaultAction, FaultPolicy
from drivers.servo.hardware_error import HardwareError


def test_telemetry_has_counters_latency_and_budget(bench):
    bench.cycle(300)
    telemetry = bench.bus.telemetry()
    assert telemetry["cycles"] == telemetry["latency"]["count"] == 300
    assert {"crc_errors", "timeouts", "stuffed", "retries", "late"} < telemetry.keys()
    assert telemetry["budget"] == {"bus": "ok", "degraded": [], "lost": []}


def test_a_silent_servo_is_degraded_then_lost_and_recovers_a_second_after_it_is_back(bench):
    bench.cycle(2)
    bench.bank.silence(3)
    bench.cycle(4)
    assert bench.bus.telemetry()["budget"]["degraded"] == ["joint_3"]
    bench.cycle(60)
    assert bench.bus.telemetry()["budget"]["lost"] == ["joint_3"]
    bench.bank.silence(3, silent=False)
    bench.cycle(120)
    assert bench.bus.state.valid.all()
    bench.run(1.0)
    bench.cycle()
    assert bench.bus.telemetry()["budget"] == {"bus": "ok", "degraded": [], "lost": []}


def test_one_servo_that_stays_away_is_not_held_against_the_bus(bench):
    bench.bank.silence(3)
    bench.cycle(600)
    assert bench.bus.telemetry()["budget"] == {"bus": "ok", "degraded": [], "lost": ["joint_3"]}


@pytest.mark.parametrize(
    ("bits", "action"),
    [
        (HardwareError.INPUT_VOLTAGE, FaultAction.LOG),
        (HardwareError.OVERHEATING, FaultAction.LIMP),
        (HardwareError.ENCODER, FaultAction.STOP),
        (HardwareError.OVERLOAD, FaultAction.REBOOT_ONCE),
    ],
)
def test_a_hardware_error_is_decided_about_once(bench, bits, action):
    bench.cycle(3)
    bench.bank.set_alert(2, bits)
    bench.cycle(30)
    decisions = bench.bus.journal.take_decisions()
    assert [(one.joint, one.bits, one.action) for one in decisions] == [("joint_2", bits, action)]
    bench.cycle(30)
    assert bench.bus.journal.take_decisions() == []


def test_a_servo_that_fails_again_after_its_reboot_stops_the_robot_until_acknowledged(bench):
    policy = FaultPolicy()
    bench.bus = DynamixelBus(bench.line, bench, bench.specs, baud=1_000_000, fault_policy=policy)
    bench.bus.connect()

    def actions() -> list[FaultAction]:
        bench.bank.set_alert(2, HardwareError.OVERLOAD)
        bench.cycle(30)
        bench.bus.reboot(2)
        bench.cycle(200)
        return [one.action for one in bench.bus.journal.take_decisions()]

    assert actions() == [FaultAction.REBOOT_ONCE]
    assert actions() == [FaultAction.STOP]
    assert actions() == [FaultAction.STOP]
    policy.acknowledge()
    assert actions() == [FaultAction.REBOOT_ONCE]
