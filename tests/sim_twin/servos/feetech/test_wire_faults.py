"""Each bus fault affects only the servo it names, and ends when it is cleared."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.feetech.codec import FeetechInstruction, FeetechParser, encode_packet

ALL = (1, 2, 3)
SYNC_READ = encode_packet(254, FeetechInstruction.SYNC_READ, bytes([56, 15, *ALL]))
FAULTS: dict[str, Callable[[Any, bool], None]] = {
    "garble": lambda bank, on: bank.garble(2, on),
    "truncate": lambda bank, on: bank.truncate(2, on),
    "silence": lambda bank, on: bank.silence(2, silent=on),
    "wrong baud": lambda bank, on: bank.set_wrong_baud(2, on),
    "all lost": lambda bank, on: bank.drop_ratio(2, 1.0 if on else 0.0),
}


@pytest.fixture
def trio(make_bench: Callable[..., Any]) -> Any:
    return make_bench(["STS3215-C018"] * 3)


def hear(trio: Any, request: bytes = SYNC_READ) -> bytes:
    trio.bank.receive(request)
    reply: bytes = trio.bank.transmit()
    return reply


def ids(raw: bytes, size: int = 15) -> list[int]:
    parser = FeetechParser()
    packets = parser.feed(raw) + parser.salvage()
    return [packet.servo_id for packet in packets if len(packet.params) == size]


@pytest.mark.parametrize("fault", FAULTS)
def test_only_the_faulty_servo_is_not_understood_until_the_fault_ends(
    trio: Any, fault: str
) -> None:
    FAULTS[fault](trio.bank, True)
    for _ in range(20):
        assert ids(hear(trio)) == [1, 3]
        assert ids(hear(trio, encode_packet(2, FeetechInstruction.PING)), 0) == []
    FAULTS[fault](trio.bank, False)
    assert ids(hear(trio)) == [1, 2, 3]


def test_a_clash_is_garbage_and_one_reply_can_be_spoiled(trio: Any) -> None:
    trio.bank.set_clash(2)
    assert ids(hear(trio)) == [1, 3]
    trio.bank.set_clash(2, False)
    trio.bank.corrupt_next(3)
    assert ids(hear(trio)) == [1, 2]
    assert ids(hear(trio)) == [1, 2, 3]


def test_servos_of_one_id_answer_at_once_until_they_are_apart(trio: Any) -> None:
    trio.write("id", 1, 2)
    assert ids(hear(trio, encode_packet(1, FeetechInstruction.PING)), 0) == []
    assert trio.bank.register(1, "id") == 1
    trio.bank.receive(encode_packet(1, FeetechInstruction.REBOOT))
    trio.run(0.9)
    trio.bank.transmit()
    assert ids(hear(trio)) == [1, 2, 3]


def test_duplicates_aliases_noise_echo_and_delays(trio: Any) -> None:
    clean, bank = hear(trio), trio.bank
    bank.duplicate(2)
    assert ids(hear(trio)) == [1, 2, 2, 3]
    bank.duplicate(2, False)
    bank.answer_as(2, 253)
    assert ids(hear(trio)) == [1, 253, 3]
    bank.answer_as(2, None)
    bank.noise(seed=3)
    assert len(hear(trio)) > len(clean)
    assert ids(hear(trio)) == [1, 2, 3]
    bank.noise(False)
    bank.set_echo()
    assert hear(trio) == SYNC_READ + clean
    bank.set_echo(False)
    bank.delay(2, 0.010)
    assert ids(hear(trio)) == [1, 3]
    trio.run(0.01)
    assert ids(bank.transmit()) == [2]


def test_a_stuck_servo_shows_what_it_sensed_last_and_still_obeys(trio: Any) -> None:
    trio.bank.stick(2)
    trio.turn_to(1000)
    assert [trio.read("present_position", n) for n in ALL] == [1000, 2048, 1000]
    trio.write("goal_position", 500, 2)
    assert trio.read("goal_position", 2) == 500
    trio.bank.stick(2, False)
    assert trio.read("present_position", 2) == 1000
