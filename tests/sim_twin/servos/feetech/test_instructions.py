"""Every instruction, and FEETECH's worked bytes."""

from collections.abc import Callable
from random import Random
from typing import Any

import pytest

from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    FeetechInstruction,
    encode_packet,
)
from sim_twin.servos import WireTiming
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank, FeetechOptions

ALL = FEETECH_BROADCAST_ID
FUZZ = [
    pytest.param(10_000),
    pytest.param(1_000_000, marks=[pytest.mark.slow, pytest.mark.timeout(3_600)]),
]


def said(bench: Any, request_: str) -> str:
    bench.bank.receive(bytes.fromhex(request_))
    reply: bytes = bench.bank.transmit()
    return reply.hex(" ").upper()


def test_worked_bytes_of_the_vendor(bench: Any) -> None:
    assert said(bench, "FF FF 01 02 01 FB") == "FF FF 01 02 00 FC"
    bench.turn_to(1304)
    assert said(bench, "FF FF 01 04 02 38 02 BE") == "FF FF 01 04 00 18 05 DD"
    assert said(bench, "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5") == "FF FF 01 02 00 FC"
    assert (bench.read("goal_position"), bench.read("goal_velocity")) == (2048, 1000)
    assert said(bench, "FF FF FE 02 05 FA") == ""
    assert said(bench, "FF FF 01 02 0A F2") == "FF FF 01 02 00 FC"


def test_the_vendors_sync_write_sets_four_goals(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(["STS3215-C018"] * 4)
    goals = "".join(f"{servo_id:02X} 00 08 00 00 E8 03 " for servo_id in (1, 2, 3, 4))
    assert said(bench, f"FF FF FE 20 83 2A 06 {goals} 58") == ""
    assert [bench.read("goal_velocity", servo_id) for servo_id in (1, 2, 3, 4)] == [1000] * 4


@pytest.mark.parametrize(
    "request_",
    [
        "FF FF 01 02 01 FA",  # check sum
        "FF FF 02 02 01 FA",  # no such servo
        "FF FF 01 02 77 85",  # no such instruction
        "FF FF 01 04 02 38 00 C0",  # no byte
        "FF FF 01 04 02 F0 20 E8",  # beyond the table
        "FF FF 01 02 02 FA",  # without address
        "FF FF FE 04 02 38 02 C1",  # a broadcast that is no ping
    ],
)
def test_what_a_servo_does_not_understand_it_does_not_answer(bench: Any, request_: str) -> None:
    assert said(bench, request_) == ""
    assert said(bench, "FF FF 01 02 01 FB") == "FF FF 01 02 00 FC"


def test_a_broadcast_ping_is_answered_in_the_order_of_ids_and_not_by_scs(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(["STS3215-C018", "STS3250", "SCS0009", "STS3215-C001"])
    bench.write("id", 9)
    pong = bench.send(ALL, FeetechInstruction.PING)
    assert [each.servo_id for each in pong] == [2, 4, 9]


def test_an_scs_servo_has_its_high_byte_first_and_no_sync_read(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(["SCS0009", "STS3215-C001"])
    bench.turn_to(600)
    (reply,) = bench.send(1, FeetechInstruction.READ, b"\x38\x02")
    assert reply.params == (600).to_bytes(2, "big")
    assert [each.servo_id for each in bench.sync_read(56, 2, (1, 2))] == [2]
    bench.write("torque_enable", 1)
    assert bench.send(ALL, FeetechInstruction.SYNC_WRITE, b"\x2a\x02\x01\x02\x00") == []
    bench.run(0.5)
    assert abs(bench.read("present_position") - 512) <= 2


def test_a_sync_read_is_answered_in_the_order_of_the_list_and_goes_on_behind_a_gap(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(["STS3215-C018"] * 4)
    bench.bank.silence(3)
    bench.bank.set_alert(2, 1 << 5)
    replies = bench.sync_read(56, 15, (4, 3, 2, 1))
    assert [(each.servo_id, each.code, len(each.params)) for each in replies] == [
        (4, 0, 15),
        (2, 0x20, 15),
        (1, 0, 15),
    ]


def test_a_registered_write_waits_for_the_action(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(["STS3215-C018"] * 2)
    for servo_id in (1, 2):
        assert len(bench.send(servo_id, FeetechInstruction.REG_WRITE, b"\x2a\x00\x04")) == 1
        assert bench.read("registered_instruction", servo_id) == 1
    assert bench.read("goal_position") == 2048
    assert bench.send(ALL, FeetechInstruction.ACTION) == []
    assert [bench.read("goal_position", n) for n in (1, 2)] == [1024, 1024]
    assert bench.read("registered_instruction") == 0
    assert len(bench.send(1, FeetechInstruction.ACTION)) == 1


def test_status_return_level_0_leaves_only_ping_and_read_answered(bench: Any) -> None:
    bench.write("status_return_level", 0)
    assert bench.send(1, FeetechInstruction.WRITE, b"\x2a\x00\x04") == []
    assert bench.read("goal_position") == 1024
    assert bench.error() == 0


def test_a_rebooting_servo_is_silent_and_forgets_its_ram(bench: Any) -> None:
    bench.write("torque_enable", 1)
    bench.write("goal_position", 1000)
    bench.run(1.0)
    assert bench.send(1, FeetechInstruction.REBOOT) == []
    bench.run(0.7)
    assert bench.send(1, FeetechInstruction.PING) == []
    bench.run(0.2)
    assert bench.read("torque_enable") == 0
    assert bench.read("goal_position") == bench.read("present_position")


def test_restore_brings_the_factory_values_or_the_backup_and_keeps_the_id(bench: Any) -> None:
    bench.write("id", 7)
    send = bench.send
    send(7, FeetechInstruction.WRITE, b"\x15\x10")  # position_p_gain = 16
    assert len(send(7, FeetechInstruction.RESTORE)) == 1
    assert send(7, FeetechInstruction.READ, b"\x15\x01")[0].params == b"\x20"
    send(7, FeetechInstruction.WRITE, b"\x15\x10")
    assert len(send(7, FeetechInstruction.BACKUP)) == 1
    send(7, FeetechInstruction.WRITE, b"\x15\x40")
    assert len(send(7, FeetechInstruction.RESTORE)) == 1
    assert send(7, FeetechInstruction.READ, b"\x15\x01")[0].params == b"\x10"


@pytest.mark.parametrize(
    ("params", "expected"), [(b"", 2048), ((1000).to_bytes(2, "little"), 1000)]
)
def test_a_calibrated_servo_is_where_it_was_said_to_be_for_good(
    bench: Any, params: bytes, expected: int
) -> None:
    bench.turn_to(3000)
    assert len(bench.send(1, FeetechInstruction.CALIBRATE_POSITION, params)) == 1
    bench.run(0.01)
    assert bench.read("present_position") == bench.read("goal_position") == expected
    bench.reboot()
    assert bench.read("present_position") == expected


def test_a_paced_bus_hears_only_its_rate_and_takes_ten_bits_a_byte() -> None:
    specs = [EmulatedFeetechSpec(id=1, model_name="STS3250", eeprom={"return_delay_time": 50})]
    bank = FeetechBank(specs, timing=WireTiming(baud=1_000_000))
    bank.set_host_baud(500_000)
    bank.receive(encode_packet(1, FeetechInstruction.PING))
    assert bank.next_due_ns() is None
    bank.set_host_baud(1_000_000)
    bank.receive(encode_packet(1, FeetechInstruction.PING))
    # The host's bytes of before take their time at the rate of before.
    assert bank.next_due_ns() == 120_000 + 60_000 + 100_000 + 60_000


@pytest.mark.parametrize("count", FUZZ)
def test_no_stream_of_bytes_brings_a_bank_down(make_bench: Callable[..., Any], count: int) -> None:
    source, models = Random(1), ("STS3215-C018", "SCS0009", "STS3250")
    for turn in range(count):
        if turn % 500 == 0:  # by then ids are all over the place
            bench = make_bench(models, options=FeetechOptions(reboot_s=0.0))
        if source.random() < 0.3:
            data = source.randbytes(source.randrange(40))
        else:
            code = source.choice([*FeetechInstruction, source.randrange(256)])
            params = source.randbytes(source.choice((0, 2, 2, 3, 5, source.randrange(40))))
            data = encode_packet(source.choice((1, 2, 3, ALL, 200)), code, params)
        bench.bank.receive(data)
        bench.bank.transmit()
        if turn % 10 == 0:
            bench.run(0.002)
            assert abs(bench.duty).max() < 3.0
