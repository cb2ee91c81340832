"""Sound of a browser's microphone reaches the speech process, within the rules of a turn."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import AuthMethod, Identity, UserRole, require
from vla_deploy.dashboard.live import microphone
from vla_deploy.dashboard.live.microphone import (
    AHEAD_S,
    LONGEST_S,
    Floor,
    PageMicrophones,
    SpeechTurn,
    SpeechTurnRefused,
    check_end,
    rate_in,
)
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.page_sound import PageSound, SoundStep, unpacked

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


Until = Callable[[Callable[[], object]], Awaitable[None]]
TALK = np.arange(1600, dtype="<i2")


class Rig:
    """Play the speech process at the other end."""

    def __init__(self, run_dir: Path) -> None:
        self.link = RobotLink(run_dir, MonotonicClock())
        self.space = SharedSpace(run_dir / "ipc", self.link.clock)
        self.microphones = PageMicrophones(self.link)
        self.records = self.space.record_reader("page_sound")
        self.space.cell_writer("speech_status").put_document({"state": "listening"})
        self.heard: list[PageSound] = []

    def steps(self) -> list[SoundStep]:
        self.heard += [unpacked(record.payload) for record in self.records.fresh()]
        return [sound.step for sound in self.heard]


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return Rig(tmp_path / "run")


@pytest.fixture
def run(rig: Rig, serve: Any, make_hub: Any) -> Callable[[Any], None]:
    """Run a talk against a server."""

    def prepare(app: Any) -> None:
        app.state.microphones = rig.microphones
        app.include_router(microphone.router)
        who = Identity(role=UserRole.OPERATOR, user="anna", way=AuthMethod.SESSION, address="")
        app.dependency_overrides[require(UserRole.OPERATOR)] = lambda: who

    async def serving(talk: Any) -> None:
        async with serve(make_hub(), prepare=prepare) as served:
            await talk(served.url.replace("/live", "/microphone"))

    return lambda talk: asyncio.run(serving(talk))


async def begin(client: ClientConnection, rate_hz: int = 16_000) -> None:
    await client.send(json.dumps({"rate_hz": rate_hz}))
    assert json.loads(await client.recv()) == {"floor": "yours"}


async def end_of(client: ClientConnection) -> tuple[int, str]:
    with pytest.raises(ConnectionClosed) as closed:
        await client.recv()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code, closed.value.rcvd.reason


@pytest.mark.parametrize("ending", ["text", "close"])
def test_sound_reaches_the_speech_process_and_letting_go_ends_the_turn(
    rig: Rig, run: Any, until: Until, ending: str
) -> None:
    async def talk(url: str) -> None:
        async with connect(url) as client:
            await begin(client, 48_000)
            await client.send(TALK.tobytes())
            await (client.send('{"end": true}') if ending == "text" else client.close())
            await until(lambda: len(rig.steps()) == 2)

    run(talk)
    assert rig.steps() == [SoundStep.SOUND, SoundStep.ENDED]
    sound, end = rig.heard
    assert (sound.rate_hz, sound.turn) == (48_000, end.turn)
    assert sound.samples.tolist() == TALK.tolist()


def test_a_client_that_is_gone_in_mid_word_cuts_its_turn_off(
    rig: Rig, run: Any, until: Until
) -> None:
    async def talk(url: str) -> None:
        client = await connect(url)
        await begin(client)
        await client.send(TALK.tobytes())
        await until(lambda: rig.steps() == [SoundStep.SOUND])
        client.transport.abort()
        await until(lambda: len(rig.steps()) == 2)

    run(talk)
    assert rig.steps() == [SoundStep.SOUND, SoundStep.CUT]
    assert rig.microphones.floor.holder is None


def test_a_page_that_is_left_cuts_its_turn_off(rig: Rig, run: Any, until: Until) -> None:
    async def talk(url: str) -> None:
        client = await connect(url)
        await begin(client)
        await client.send(TALK.tobytes())
        await client.close(1001)
        await until(lambda: len(rig.steps()) == 2)

    run(talk)
    assert rig.steps()[-1] is SoundStep.CUT


def test_whoever_comes_second_is_told_who_speaks_and_may_speak_afterwards(
    rig: Rig, run: Any, until: Until
) -> None:
    async def talk(url: str) -> None:
        async with connect(url) as first, connect(url) as second, connect(url) as third:
            await begin(first)
            await second.send('{"rate_hz": 16000}')
            assert await end_of(second) == (4409, "anna speaks to the robot; wait a moment")
            await first.send('{"end": true}')
            await until(lambda: rig.microphones.floor.holder is None)
            await begin(third)

    run(talk)


@pytest.mark.parametrize(
    ("message", "code", "word"),
    [
        (b"\x01\x02\x03", 1007, "16-bit"),
        (bytes(40_000), 1009, "a second"),
        ("stop talking", 1008, "end"),
        ("x" * 70_000, 1008, "end"),
    ],
)
def test_garbage_ends_the_turn_with_its_reason_and_nothing_is_carried_out(
    rig: Rig, run: Any, message: str | bytes, code: int, word: str
) -> None:
    async def talk(url: str) -> None:
        async with connect(url) as client:
            await begin(client)
            await client.send(message)
            told, reason = await end_of(client)
            assert (told, word in reason) == (code, True)

    run(talk)
    assert rig.steps() == [SoundStep.CUT]


def test_a_flood_is_refused_after_a_second_and_a_half_of_sound(rig: Rig, run: Any) -> None:
    async def talk(url: str) -> None:
        async with connect(url) as client:
            await begin(client)
            for _ in range(5):
                await client.send(bytes(32_000))
            assert (await end_of(client))[0] == 4429

    run(talk)
    assert rig.steps()[-1] is SoundStep.CUT


def test_whoever_sends_nothing_loses_the_floor(
    rig: Rig, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def talk(url: str) -> None:
        async with connect(url) as client:
            await begin(client)
            monkeypatch.setattr(microphone, "SILENT_S", 0.05)
            await client.send(bytes(640))  # the wait for it began before, the next one is short
            assert (await end_of(client))[0] == 4408

    run(talk)
    assert rig.microphones.floor.holder is None


def test_a_robot_without_a_speech_process_says_so(
    rig: Rig, run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(microphone, "_STATUS_AGE_S", -1.0)

    async def talk(url: str) -> None:
        async with connect(url) as client:
            await client.send('{"rate_hz": 16000}')
            assert (await end_of(client))[0] == 1013

    run(talk)
    assert rig.steps() == []
