from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.audio.base import AudioFormat, AudioOutput
from drivers.audio.espeak import EspeakEngine
from drivers.audio.pcm_stream import PcmOutput
from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing
from sim_twin.contracts.scripted import ManualClock
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.sound import SpeakerDevice
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.speech.voice.robot_voice import RobotVoice

STEP_NS = NS_PER_S // 50
FORMAT = AudioFormat(rate_hz=16_000)


class VoiceRig:
    """Step a voice that speaks to the twin's speaker, on a clock of the test's own."""

    format = FORMAT
    step_ns = STEP_NS

    def __init__(
        self, folder: Path, clock: ManualClock, engine: EspeakEngine | None = None
    ) -> None:
        self.clock = clock
        self.speaker = SpeakerDevice(FORMAT)
        self.is_plugged = True
        self.line: MemoryLine | None = None
        self.space = SharedSpace(folder / "ipc", clock)
        self.voice = RobotVoice(
            engine or EspeakEngine(), self._open, clock, InlineExecutor(), volume_ratio=0.8
        )
        self.voice.start(self.space)
        self._say = self.space.ring_writer("say")
        self._told = self.space.ring_reader("voice_event", from_start=True)
        self.events: list[tuple[str, str]] = []
        self.reasons: dict[str, str] = {}
        self.times_ns: dict[tuple[str, str], int] = {}
        self.run(0.1)

    def say(self, say_id: str, text: str = "I am on my way", **more: Any) -> None:
        self._say.publish({"say_id": say_id, "text": text, "source": "test"} | more)

    def publish(self, message: dict[str, Any]) -> None:
        self._say.publish(message)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * NS_PER_S / STEP_NS)):
            self.clock.ns += STEP_NS
            self.voice.step()
            self._note()

    def run_until(self, say_id: str, event: str, at_most_s: float = 40.0) -> None:
        end_ns = self.clock.ns + round(at_most_s * NS_PER_S)
        while (say_id, event) not in self.events:
            assert self.clock.ns < end_ns, f"{say_id} not {event}: {self.events}"
            self.run(0.02)

    def unplug(self) -> None:
        self.is_plugged = False
        if self.line is not None:
            self.line.unplug()

    def replug(self) -> None:
        self.is_plugged = True

    def _open(self) -> AudioOutput:
        if not self.is_plugged:
            raise DeviceMissing("sound device 'USB Audio': not there; plug it in")
        self.line = MemoryLine(self.speaker, self.clock)
        return PcmOutput(self.line, self.clock, FORMAT)

    def _note(self) -> None:
        for told in self._told.drain():
            key = (told.payload["say_id"], told.payload["event"])
            self.events.append(key)
            self.reasons[key[0]] = told.payload["reason"]
            self.times_ns[key] = self.clock.ns


@pytest.fixture
def make_rig(tmp_path: Path, clock: ManualClock) -> Iterator[Callable[..., VoiceRig]]:
    made: list[VoiceRig] = []

    def make(engine: EspeakEngine | None = None) -> VoiceRig:
        made.append(VoiceRig(tmp_path, clock, engine))
        return made[-1]

    yield make
    for rig in made:
        rig.voice.close()
        rig.space.close()


@pytest.fixture
def rig(make_rig: Callable[..., VoiceRig]) -> VoiceRig:
    return make_rig()
