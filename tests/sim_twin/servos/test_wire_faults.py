"""Each bus fault affects only the servo it names, and ends when it is cleared."""

import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    Instruction,
    Packet,
    PacketParser,
    decode_fast_entries,
    encode_instruction,
)

ALL = (1, 2, 3)
MODELS = ("XM430-W350", "XL430-W250", "XM540-W270")
BLOCK = struct.pack("<HH", 126, 10)
SYNC_READ = encode_instruction(BROADCAST_ID, Instruction.SYNC_READ, BLOCK + bytes(ALL))
FAST_READ = encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, BLOCK + bytes(ALL))
MS = 1_000_000


@pytest.fixture
def trio(make_bench: Callable[..., Any]) -> Any:
    return make_bench(MODELS)


def hear(trio: Any, request: bytes = SYNC_READ) -> bytes:
    trio.bank.receive(request)
    reply: bytes = trio.bank.transmit()
    return reply


def understood(raw: bytes) -> list[Packet]:
    parser = PacketParser()
    parser.feed(raw)
    return [packet for packet in parser.packets() + parser.salvage() if packet.error is not None]


def ids(raw: bytes) -> list[int]:
    return [packet.servo_id for packet in understood(raw)]


def fast_ids(raw: bytes) -> list[int]:
    return [servo_id for _, servo_id, _ in decode_fast_entries(raw, 10)]


SPOILERS: dict[str, Callable[[Any, bool], None]] = {
    "garble": lambda bank, on: bank.garble(2, on),
    "truncate": lambda bank, on: bank.truncate(2, on),
    "clash": lambda bank, on: bank.set_clash(2, on),
    "silence": lambda bank, on: bank.silence(2, silent=on),
    "wrong baud": lambda bank, on: bank.set_wrong_baud(2, on),
    "all lost": lambda bank, on: bank.drop_ratio(2, 1.0 if on else 0.0),
}


@pytest.mark.parametrize("fault", SPOILERS)
def test_only_the_faulty_servo_is_not_understood_until_the_fault_ends(
    trio: Any, fault: str
) -> None:
    SPOILERS[fault](trio.bank, True)
    for _ in range(20):
        assert ids(hear(trio)) == [1, 3]
        assert ids(hear(trio, encode_instruction(2, Instruction.PING))) == []
        assert fast_ids(hear(trio, FAST_READ)) == [1]
    SPOILERS[fault](trio.bank, False)
    assert ids(hear(trio)) == [1, 2, 3]
    assert fast_ids(hear(trio, FAST_READ)) == [1, 2, 3]


@pytest.mark.parametrize("fault", SPOILERS)
def test_two_banks_with_the_same_fault_say_the_same_bytes(
    make_bench: Callable[..., Any], fault: str
) -> None:
    said = []
    for _ in range(2):
        bench = make_bench(MODELS)
        SPOILERS[fault](bench.bank, True)
        bench.bank.noise()
        said.append([hear(bench) for _ in range(10)])
    assert said[0] == said[1]


def test_a_silenced_servo_does_not_obey_and_a_garbled_one_does(trio: Any) -> None:
    trio.bank.garble(2)
    trio.bank.silence(3)
    for servo_id in ALL:
        trio.bank.receive(encode_instruction(servo_id, Instruction.WRITE, b"\x41\x00\x01"))
    assert [trio.bank.register(servo_id, "led") for servo_id in ALL] == [1, 1, 0]


def test_a_duplicated_reply_is_there_twice(trio: Any) -> None:
    trio.bank.duplicate(2)
    assert ids(hear(trio)) == [1, 2, 2, 3]
    trio.bank.duplicate(2, False)
    assert ids(hear(trio)) == [1, 2, 3]


def test_a_servo_can_answer_as_another_one(trio: Any) -> None:
    trio.bank.answer_as(2, 9)
    assert ids(hear(trio)) == [1, 9, 3]
    assert fast_ids(hear(trio, FAST_READ)) == [1, 9, 3]
    assert ids(hear(trio, encode_instruction(9, Instruction.PING))) == []
    trio.bank.answer_as(2, None)
    assert ids(hear(trio)) == [1, 2, 3]


def test_noise_before_every_reply_costs_no_reply(trio: Any) -> None:
    clean = hear(trio)
    trio.bank.noise(seed=4)
    noisy = hear(trio)
    assert len(noisy) > len(clean)
    assert ids(noisy) == [1, 2, 3]
    trio.bank.noise(False)
    assert hear(trio) == clean


def test_a_share_of_the_replies_is_lost_by_the_seed(make_bench: Callable[..., Any]) -> None:
    def answered(seed: int) -> list[bool]:
        bench = make_bench(MODELS)
        bench.bank.drop_ratio(2, 0.25, seed)
        return [2 in ids(hear(bench)) for _ in range(400)]

    assert answered(1) == answered(1)
    assert answered(1) != answered(2)
    assert 0.7 < sum(answered(1)) / 400 < 0.8


@pytest.mark.parametrize("request_", [SYNC_READ, FAST_READ])
def test_a_stuck_servo_shows_what_it_sensed_last_and_still_obeys(
    trio: Any, request_: bytes
) -> None:
    before = hear(trio, request_)
    trio.bank.stick(2)
    trio.turn_to(1.0)
    trio.run(0.1)
    stuck = hear(trio, request_)
    assert trio.read("present_position", 2) == 2048
    assert trio.read("present_position", 1) > 2100
    assert stuck != before
    tick = trio.read("realtime_tick", 2)
    trio.run(0.1)
    assert trio.read("realtime_tick", 2) == tick
    assert trio.write("led", 1, 2) == 0
    assert trio.read("led", 2) == 1
    trio.bank.stick(2, False)
    assert trio.read("present_position", 2) > 2100


def test_a_late_reply_comes_when_its_time_has_come(trio: Any) -> None:
    trio.bank.delay(2, 0.010)
    assert ids(hear(trio)) == [1, 3]
    due_ns = trio.bank.next_due_ns()
    trio.bank.step(due_ns - 1)
    assert trio.bank.transmit() == b""
    trio.bank.step(due_ns)
    assert ids(trio.bank.transmit()) == [2]
    assert trio.bank.next_due_ns() is None
    trio.bank.delay(2, 0.0)
    assert ids(hear(trio)) == [1, 2, 3]


def test_behind_a_late_servo_the_rest_of_a_fast_read_is_late_too(trio: Any) -> None:
    whole = hear(trio, FAST_READ)
    trio.bank.delay(2, 0.010)
    now_ns = trio.now_ns
    first = hear(trio, FAST_READ)
    assert fast_ids(first) == [1]
    trio.bank.step(now_ns + 10 * MS)
    assert first + trio.bank.transmit() == whole


def test_an_echoing_adapter_returns_the_request_first(trio: Any) -> None:
    clean = hear(trio)
    trio.bank.set_echo()
    assert hear(trio) == SYNC_READ + clean
    trio.bank.set_echo(False)
    assert hear(trio) == clean


def test_the_name_of_an_unknown_servo_is_refused_with_those_there_are(trio: Any) -> None:
    with pytest.raises(KeyError, match=r"no servo has the id 9; there are \[1, 2, 3\]"):
        trio.bank.garble(9)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda bank: bank.delay(1, -0.1), "expected 0 s or more, got -0.1"),
        (lambda bank: bank.drop_ratio(1, 1.5), r"expected 0\.\.1, got 1.5"),
        (lambda bank: bank.answer_as(1, 253), r"expected 0\.\.252, got 253"),
    ],
)
def test_a_fault_that_no_servo_can_have_is_refused_and_changes_nothing(
    trio: Any, wrong: Callable[[Any], None], said: str
) -> None:
    clean = hear(trio)
    with pytest.raises(ValueError, match=said):
        wrong(trio.bank)
    assert hear(trio) == clean
