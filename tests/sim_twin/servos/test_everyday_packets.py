"""The packets of every cycle are carried out in one go, to the same effect as one by one.

A bulk read or write says the same as a sync one, and knows no short cut.
"""

import struct
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.wire.codec import BROADCAST_ID, Instruction, encode_instruction

MODELS = ("XM430-W350", "XL430-W250", "XM540-W270")
IDS = (1, 2, 3)
TABLE_BYTES = 146

SETTINGS = (
    ("operating_mode", OperatingMode.EXTENDED_POSITION),
    ("operating_mode", OperatingMode.VELOCITY),
    ("drive_mode", 4),
    ("drive_mode", 8),
    ("max_position_limit", 3000),
    ("min_position_limit", 1000),
    ("status_return_level", 0),
    ("torque_enable", 0),
    ("torque_enable", 1),
    ("bus_watchdog", 1),
    ("profile_velocity", 50),
)
DISTURBANCES = st.one_of(
    st.tuples(st.just("write"), st.sampled_from(IDS), st.sampled_from(SETTINGS)),
    st.tuples(st.just("alert"), st.sampled_from(IDS), st.sampled_from([4, 32])),
    st.tuples(st.just("reboot"), st.sampled_from(IDS), st.none()),
    st.tuples(st.just("map"), st.sampled_from(IDS), st.sampled_from([132, 70, 116, 144])),
)
WAITS = st.tuples(st.just("run"), st.sampled_from([0.0, 0.002, 0.002, 0.05, 0.3]), st.none())
ASKED = st.one_of(st.just(list(IDS)), st.lists(st.sampled_from([*IDS, 9]), min_size=1, max_size=4))
GOALS = st.lists(st.sampled_from([0, 1500, 2048, 3500, 4095, -5, 4096, 2**21]), min_size=4)
SPANS = st.sampled_from([(126, 10), (116, 4), (0, 0), (140, 8), (64, 30), (224, 8), (220, 9)])
CYCLES = st.tuples(
    DISTURBANCES,
    WAITS,
    st.tuples(st.just("goals"), ASKED, GOALS),
    st.tuples(st.sampled_from(["read", "read plainly"]), ASKED, SPANS),
)
SYNC_READS = {"read": Instruction.FAST_SYNC_READ, "read plainly": Instruction.SYNC_READ}
BULK_READS = {"read": Instruction.FAST_BULK_READ, "read plainly": Instruction.BULK_READ}
EVERYONE = [("write", servo_id, ("torque_enable", 1)) for servo_id in IDS]


def sync(act: str, ids: list[int], what: Any) -> bytes:
    """Return the packet of a cycle."""
    if act in SYNC_READS:
        params = struct.pack("<HH", *what) + bytes(ids)
        return encode_instruction(BROADCAST_ID, SYNC_READS[act], params)
    goals = b"".join(struct.pack("<Bi", *pair) for pair in zip(ids, what, strict=False))
    params = struct.pack("<HH", 116, 4) + goals
    return encode_instruction(BROADCAST_ID, Instruction.SYNC_WRITE, params)


def bulk(act: str, ids: list[int], what: Any) -> bytes:
    """Return the packet that asks for the same, servo by servo."""
    if act in BULK_READS:
        params = b"".join(struct.pack("<BHH", servo_id, *what) for servo_id in ids)
        return encode_instruction(BROADCAST_ID, BULK_READS[act], params)
    pairs = zip(ids, what, strict=False)
    params = b"".join(struct.pack("<BHHi", servo_id, 116, 4, goal) for servo_id, goal in pairs)
    return encode_instruction(BROADCAST_ID, Instruction.BULK_WRITE, params)


def play(bench: Any, acts: list[Any], packet: Callable[..., bytes]) -> list[bytes]:
    """Do everything and return every byte that came back, whole control tables included."""
    said = []
    for act, who, what in acts:
        if act == "write":
            register = bench.models[who - 1].registers[what[0]]
            params = struct.pack("<H", register.address) + register.to_bytes(what[1])
            bench.bank.receive(encode_instruction(who, Instruction.WRITE, params))
        elif act == "map":
            targets = struct.pack("<H6H", 170, *range(what, what + 6))
            bench.bank.receive(encode_instruction(who, Instruction.WRITE, targets))
        elif act == "alert":
            bench.bank.set_alert(who, what)
        elif act == "reboot":
            bench.bank.receive(encode_instruction(who, Instruction.REBOOT))
        elif act == "run":
            bench.run(who)
        else:
            bench.bank.receive(packet(act, who, what))
        said.append(bench.bank.transmit())
    return [*said, tables(bench)]


def tables(bench: Any) -> bytes:
    for servo_id in IDS:
        bench.send(servo_id, Instruction.WRITE, b"\x44\x00\x02")  # status return level: all
    return b"".join(
        packet.params
        for servo_id in IDS
        for packet in bench.send(servo_id, Instruction.READ, struct.pack("<HH", 0, TABLE_BYTES))
    )


@pytest.mark.parametrize("setting", SETTINGS)
def test_no_setting_of_a_servo_makes_a_difference(
    make_bench: Callable[..., Any], setting: tuple[str, int]
) -> None:
    off, on, wait = ("write", 2, ("torque_enable", 0)), EVERYONE[1], ("run", 0.1, None)
    change, timed = ("write", 2, setting), ("write", 2, ("profile_velocity", 500))
    cycles: list[Any] = []
    for goal in (2048, -1, 500, 3500, 4095, 4096):
        cycles += [("goals", list(IDS), [1900, goal, 2200]), ("read", list(IDS), (126, 10)), wait]
    acts = [*EVERYONE, timed, wait, change, *cycles, off, change, on, wait, *cycles, off, *cycles]
    assert play(make_bench(MODELS), acts, sync) == play(make_bench(MODELS), acts, bulk)


@settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(cycles=st.lists(CYCLES, max_size=4))
def test_a_cycles_packets_do_what_bulk_ones_do(
    make_bench: Callable[..., Any], cycles: list[Any]
) -> None:
    acts = [*EVERYONE, ("run", 0.01, None), *(act for cycle in cycles for act in cycle)]
    assert play(make_bench(MODELS), acts, sync) == play(make_bench(MODELS), acts, bulk)


@pytest.mark.parametrize("silent", IDS)
def test_a_silent_servo_leaves_the_goals_of_the_others(
    make_bench: Callable[..., Any], silent: int
) -> None:
    bench = make_bench(MODELS)
    play(bench, [*EVERYONE, ("run", 0.01, None)], sync)
    bench.bank.silence(silent)
    play(bench, [("goals", list(IDS), [1500] * 3)], sync)
    bench.bank.silence(silent, silent=False)
    assert [bench.read("goal_position", n) == 1500 for n in IDS] == [n != silent for n in IDS]
