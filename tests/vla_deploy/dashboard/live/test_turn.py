"""Each rule of a turn at the page's microphone, at its boundary."""

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.dashboard.live.microphone import (
    AHEAD_S,
    LONGEST_S,
    Floor,
    SpeechTurn,
    SpeechTurnRefused,
    check_end,
    rate_in,
)

RATE_HZ = 16_000


def sound(seconds: float) -> bytes:
    return bytes(2 * round(seconds * RATE_HZ))


def test_samples_are_taken_as_they_are() -> None:
    assert SpeechTurn(RATE_HZ, 0).take(b"\x01\x00\xff\xff\x00\x80", 0).tolist() == [1, -1, -32768]
    assert SpeechTurn(RATE_HZ, 0).take(b"", 0).tolist() == []


@pytest.mark.parametrize(("data", "code"), [(b"\x01", 1007), (sound(1.0) + b"\x00\x00", 1009)])
def test_what_is_no_sound_or_too_much_of_it_ends_the_turn(data: bytes, code: int) -> None:
    with pytest.raises(SpeechTurnRefused) as refused:
        SpeechTurn(RATE_HZ, 0).take(data, 0)
    assert refused.value.code == code


def test_sound_may_come_a_little_ahead_of_time_but_not_faster_than_speech() -> None:
    turn = SpeechTurn(RATE_HZ, 0)
    turn.take(sound(1.0), 0)
    turn.take(sound(AHEAD_S - 1.0), 0)
    with pytest.raises(SpeechTurnRefused, match="faster") as refused:
        turn.take(sound(0.1), NS_PER_S // 20)
    assert refused.value.code == 4429


def test_a_turn_as_long_as_no_command_is_ended() -> None:
    turn = SpeechTurn(RATE_HZ, 0)
    for second in range(int(LONGEST_S)):
        turn.take(sound(1.0), (second + 1) * NS_PER_S)
    with pytest.raises(SpeechTurnRefused) as refused:
        turn.take(sound(0.1), round((LONGEST_S + 0.1) * NS_PER_S))
    assert refused.value.code == 4413


def test_one_has_the_floor_and_the_other_is_told_who() -> None:
    floor = Floor()
    floor.take("anna")
    with pytest.raises(SpeechTurnRefused, match="anna speaks") as refused:
        floor.take("ben")
    assert refused.value.code == 4409
    floor.leave()
    floor.take("ben")


@pytest.mark.parametrize("rate_hz", [16_000, 48_000])
def test_a_turn_declares_its_rate(rate_hz: int) -> None:
    assert rate_in(f'{{"rate_hz": {rate_hz}}}') == rate_hz


@pytest.mark.parametrize(
    "text", ["", "{", "[16000]", "{}", '{"rate_hz": 44100}', '{"rate_hz": true}', "[" * 9000]
)
def test_another_beginning_is_refused(text: str) -> None:
    with pytest.raises(SpeechTurnRefused, match="rate_hz"):
        rate_in(text)


def test_text_within_a_turn_ends_it_or_is_refused() -> None:
    check_end('{"end": true}')
    with pytest.raises(SpeechTurnRefused, match="end"):
        check_end('{"end": false}')
