"""Emergencies are decoded, and the gravest complaint of a drive is kept whatever follows it."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.canopen import DriveSpec
from drivers.canopen.drive_port import DrivePort
from drivers.canopen.emergency import decode_emergency
from drivers.canopen.error_codes import CODE_RULES, CODE_TEXTS, GROUP_RULES, code_text, reset_rule
from drivers.canopen.objects import EMERGENCY_WIRE
from drivers.errors import DeviceFault, ProtocolError
from drivers.wheel_drives.bus import ResetRule

SHORT_CIRCUIT, OVER_TEMPERATURE, HEARTBEAT_LOST, CLEARED = 0x2340, 0x4310, 0x8130, 0


def test_a_lost_heartbeat_is_decoded_into_words() -> None:
    emergency = decode_emergency(bytes.fromhex("3081 11 0000000000"), 5)
    assert emergency.text == "0x8130 heartbeat of the master lost"
    assert (emergency.error_register, emergency.received_ns) == (0x11, 5)
    assert not emergency.is_reset
    assert decode_emergency(bytes(8), 0).is_reset
    with pytest.raises(ProtocolError, match="3 bytes, expected 8"):
        decode_emergency(b"abc", 0)


def test_every_code_has_a_text_and_a_rule() -> None:
    for code in range(0x1_0000):
        emergency = decode_emergency(EMERGENCY_WIRE.pack(code, 0, b""), 0)
        assert emergency.text.startswith(f"0x{code:04X} ")
        assert emergency.rule


@pytest.mark.parametrize(
    ("code", "rule"),
    [
        (SHORT_CIRCUIT, ResetRule.NEVER),
        (0x5410, ResetRule.NEVER),
        (HEARTBEAT_LOST, ResetRule.AUTOMATIC),
        (0x3220, ResetRule.OPERATOR),
        (0xFF42, ResetRule.OPERATOR),
    ],
)
def test_damage_is_never_reset(code: int, rule: ResetRule) -> None:
    assert reset_rule(code) is rule
    assert set(CODE_RULES) <= set(CODE_TEXTS)
    assert set(GROUP_RULES.values()) == {ResetRule.NEVER}


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0x2399, "0x2399 current at the motor"),
        (0x7999, "0x7999 additional modules"),
        (0xE000, "0xE000 reserved code"),
    ],
)
def test_an_unlisted_code_is_described_by_its_group(code: int, text: str) -> None:
    assert code_text(code) == text


@pytest.fixture
def port() -> DrivePort:
    return DrivePort(DriveSpec(node_id=1, joint="left"), 100_000_000)


def report(port: DrivePort, code: int, register: int = 0x01) -> None:
    port.on_emergency(EMERGENCY_WIRE.pack(code, register, bytes(5)), 0)


@pytest.mark.parametrize(
    ("codes", "kept"),
    [
        ((SHORT_CIRCUIT, HEARTBEAT_LOST), SHORT_CIRCUIT),
        ((HEARTBEAT_LOST, SHORT_CIRCUIT), SHORT_CIRCUIT),
        ((SHORT_CIRCUIT, OVER_TEMPERATURE, HEARTBEAT_LOST), SHORT_CIRCUIT),
        ((OVER_TEMPERATURE, HEARTBEAT_LOST), OVER_TEMPERATURE),
        ((OVER_TEMPERATURE, 0x3210), 0x3210),
        ((SHORT_CIRCUIT, *[HEARTBEAT_LOST] * 1000), SHORT_CIRCUIT),
    ],
)
def test_the_gravest_fault_is_kept_and_the_newest_of_equals(
    port: DrivePort, codes: tuple[int, ...], kept: int
) -> None:
    for code in codes:
        report(port, code)
    assert port.fault is not None
    assert port.fault.code == kept


def test_an_error_that_goes_while_others_last_takes_nothing_back(port: DrivePort) -> None:
    report(port, SHORT_CIRCUIT)
    report(port, CLEARED, register=0x03)
    assert port.reset_rule is ResetRule.NEVER
    report(port, CLEARED, register=0x00)
    assert port.fault is None


def test_a_short_circuit_stays_one_when_the_heartbeat_is_lost_after_it(single: Any) -> None:
    single.bus.connect()
    single.drives[0].raise_fault(SHORT_CIRCUIT)
    single.drives[0].raise_fault(HEARTBEAT_LOST)
    single.run(0.02)
    (refusal,) = single.bus.reset_fault()
    assert "0x2340" in refusal
    assert single.run(0.8).faulted == (True,)


def test_a_new_host_finds_the_short_circuit_in_the_error_field(single: Any) -> None:
    single.drives[0].raise_fault(SHORT_CIRCUIT)
    single.drives[0].raise_fault(HEARTBEAT_LOST)
    with pytest.raises(DeviceFault, match="0x2340"):
        single.bus.connect()


def test_a_drive_that_refuses_its_error_field_is_judged_by_its_latest_code(single: Any) -> None:
    single.drives[0].raise_fault(HEARTBEAT_LOST)
    for row in range(5):
        del single.drives[0]._objects._variables[0x1003, row]
    single.bus.connect()


@pytest.mark.parametrize(("code", "stays"), [(0x8140, False), (OVER_TEMPERATURE, True)])
def test_only_a_communication_fault_found_at_connect_is_reset_without_the_operator(
    make_bench: Callable[..., Any], code: int, stays: bool
) -> None:
    bench = make_bench()

    def fail_at_start(frame: Any) -> None:
        if frame.arbitration_id == 0 and frame.data[0] == 0x01:
            bench.drives[0].raise_fault(code)

    bench.wire.attach(fail_at_start)
    bench.bus.connect()
    assert bench.run(0.08, [0.0]).faulted == (stays,)
