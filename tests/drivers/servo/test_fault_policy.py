import pytest

from drivers.servo.fault_policy import (
    DEFAULT_RULES,
    FaultAction,
    FaultDecision,
    FaultPolicy,
    FaultRule,
    describe_bits,
)
from drivers.servo.hardware_error import HardwareError


def decided(policy: FaultPolicy, bits: int, servo_id: int = 3) -> FaultDecision:
    decision = policy.decide(servo_id, "left_elbow", bits)
    assert decision is not None
    return decision


@pytest.mark.parametrize("bit", list(HardwareError))
def test_every_error_of_the_manual_has_a_rule_that_is_followed(bit: HardwareError) -> None:
    decision = decided(FaultPolicy(), bit)
    assert (decision.action, decision.reason) == (
        DEFAULT_RULES[bit].action,
        DEFAULT_RULES[bit].reason,
    )
    assert decision.bits == bit


def test_a_decision_reads_as_a_log_line() -> None:
    line = str(decided(FaultPolicy(), HardwareError.OVERHEATING | HardwareError.INPUT_VOLTAGE))
    assert line.startswith("servo 3 (left_elbow): input voltage, overheating: limp; ")


def test_of_several_bits_the_gravest_action_counts() -> None:
    for bit in HardwareError:
        assert decided(FaultPolicy(), bit | HardwareError.ENCODER).action is FaultAction.STOP


@pytest.mark.parametrize("bits", [0x02, 0x80, 0x82, 0xC2])
def test_bits_that_the_manual_does_not_name_stop_the_robot(bits: int) -> None:
    decision = decided(FaultPolicy(), bits)
    assert decision.action is FaultAction.STOP
    assert "unknown bit" in decision.errors


def test_a_bit_that_stays_is_decided_about_once() -> None:
    policy = FaultPolicy()
    decided(policy, HardwareError.OVERHEATING)
    assert policy.decide(3, "left_elbow", HardwareError.OVERHEATING) is None
    assert policy.decide(3, "left_elbow", 0) is None
    assert decided(policy, HardwareError.OVERHEATING).action is FaultAction.LIMP


def test_a_bit_that_comes_on_top_is_decided_about_with_the_others() -> None:
    policy = FaultPolicy()
    decided(policy, HardwareError.INPUT_VOLTAGE)
    decision = decided(policy, HardwareError.INPUT_VOLTAGE | HardwareError.ELECTRICAL_SHOCK)
    assert decision.errors == "input voltage, electrical shock"
    assert decision.action is FaultAction.STOP


def test_a_bit_that_goes_while_another_stays_needs_no_decision() -> None:
    policy = FaultPolicy()
    decided(policy, HardwareError.INPUT_VOLTAGE | HardwareError.OVERHEATING)
    assert policy.decide(3, "left_elbow", HardwareError.OVERHEATING) is None


def test_a_reboot_is_ordered_once_however_often_the_fault_comes_back() -> None:
    policy = FaultPolicy()
    actions = []
    for _ in range(100):
        actions.append(decided(policy, HardwareError.OVERLOAD).action)
        policy.decide(3, "left_elbow", 0)
    assert actions == [FaultAction.REBOOT_ONCE] + [FaultAction.STOP] * 99


def test_a_reboot_of_one_servo_does_not_use_up_that_of_another() -> None:
    policy = FaultPolicy()
    for servo_id in (3, 4):
        decision = decided(policy, HardwareError.OVERLOAD, servo_id)
        assert decision.action is FaultAction.REBOOT_ONCE


def test_a_person_who_has_looked_allows_the_next_reboot() -> None:
    policy = FaultPolicy()
    decided(policy, HardwareError.OVERLOAD)
    policy.decide(3, "left_elbow", 0)
    policy.acknowledge()
    assert decided(policy, HardwareError.OVERLOAD).action is FaultAction.REBOOT_ONCE


def test_another_table_decides_otherwise() -> None:
    rules = {HardwareError.ENCODER: FaultRule(action=FaultAction.LOG, reason="on the bench")}
    policy = FaultPolicy(rules)
    assert decided(policy, HardwareError.ENCODER).reason == "on the bench"
    assert decided(policy, HardwareError.OVERLOAD, 4).action is FaultAction.STOP


def test_no_bits_are_no_error() -> None:
    assert FaultPolicy().decide(3, "left_elbow", 0) is None
    assert describe_bits(0) == "none"
