"""Microphone, speaker and people in one room: the robot does not hear itself, and is interrupted.

The real node with the real voice network, the real voice and the twin's devices; only the physics
is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.contracts.scripted import ManualClock
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.lines import MemoryLine
from sim_twin.sensors.sound import MicrophoneDevice, SpeakerDevice
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.aside import AtOnce
from vla_deploy.ipc import Announcer, SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.robots import load_robot
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.sound import SoundBlock
from vla_deploy.speech.voice.engines import build_voice

FORMAT = AudioFormat(rate_hz=16_000)
SENTENCES = (
    "I have put the red cup into the box",
    "stop, I do not see the green ball on the table",
    "now I drive back to the kitchen table and wait for you",
)


class Raw:
    """Listen as the stop words do."""

    name = "raw"

    def __init__(self) -> None:
        self.seconds = 0.0

    def start(self, space: SharedSpace) -> None:
        """Open nothing."""

    def feed(self, block: SoundBlock) -> None:
        self.seconds += len(block.samples) / 16_000

    def document(self) -> dict[str, Any]:
        return {}

    def close(self) -> None:
        """Release nothing."""


class RoomRig:
    """Step a speech process whose ears and mouth are in the twin's room."""

    def __init__(self, context: NodeContext, clock: ManualClock) -> None:
        self.clock = clock
        self.ear = MicrophoneDevice(FORMAT, seed=1)
        self.mouth = SpeakerDevice(FORMAT, self.ear.room)
        robot = load_robot("butler")
        self.raw = Raw()
        self.space = SharedSpace(context.run_dir / "ipc", clock)
        self.node = SpeechNode(
            context,
            robot,
            load_profile("desktop"),
            lambda: PcmInput(self._line(self.ear), clock, FORMAT),
            voice=build_voice(
                robot.voice,
                lambda: PcmOutput(self._line(self.mouth), clock, FORMAT),
                clock,
                AtOnce(),
            ),
            listeners=[self.raw],
        )
        self.node.start()
        self.announcer = Announcer(self.space, "test", clock)
        self._heard = self.space.ring_reader("heard", from_start=False)
        self._status = self.space.cell_reader("speech_status")
        self.run(0.5)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 50)):
            self.clock.ns += NS_PER_S // 50
            self.node.step()

    def say(self, text: str) -> str:
        """Have the robot say something to its end; return how that ended."""
        say_id = self.announcer.say(text)
        for _ in range(1_000):
            self.run(0.02)
            ended = self.announcer.ended(say_id)
            if ended is not None:
                return f"{ended.event} {ended.reason}".strip()
        raise AssertionError(f"{text}: without end")

    def heard(self) -> list[dict[str, Any]]:
        return [event.payload for event in self._heard.drain()]

    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()

    def _line(self, device: MicrophoneDevice | SpeakerDevice) -> MemoryLine:
        device.step(self.clock.ns)
        device.announce()
        return MemoryLine(LineTamper(device, self.clock.now_ns), self.clock)


@pytest.fixture
def room(context: NodeContext, clock: ManualClock) -> Iterator[RoomRig]:
    made = RoomRig(context, clock)
    yield made
    made.node.stop()
    made.space.close()


def test_the_robot_does_not_hear_itself(room: RoomRig) -> None:
    for sentence in (*SENTENCES, *SENTENCES):
        assert room.say(sentence) == "finished"
        room.run(1.0)
    assert room.heard() == []
    counts = room.status()["room"]["counts"]
    assert counts.get("barged_in", 0) == 0
    assert counts.get("began", 0) == 0


def test_a_person_who_speaks_into_what_the_robot_says_silences_it(room: RoomRig) -> None:
    for sentence in SENTENCES:
        room.say(sentence)
        room.run(0.5)
    say_id = room.announcer.say("so I went on, and on, and on, to the very end of the long way")
    room.run(1.5)
    person = arrival("robot, come here please", Talker(), 16_000, room.ear.room.acoustics)
    began_ns = room.clock.ns
    room.ear.room.lay(person.sound.wave, room.ear.room.row_at(began_ns))
    for _ in range(100):
        room.run(0.02)
        ended = room.announcer.ended(say_id)
        if ended is not None:
            break
    assert ended is not None
    assert ended.event == "interrupted"
    assert room.clock.ns - began_ns < 0.6 * NS_PER_S


def test_whoever_listens_to_the_raw_stream_misses_nothing(room: RoomRig) -> None:
    before_s, began_ns = room.raw.seconds, room.clock.ns
    room.say(SENTENCES[0])
    room.run(1.0)
    passed_s = (room.clock.ns - began_ns) / NS_PER_S
    assert room.raw.seconds - before_s == pytest.approx(passed_s, abs=0.05)
