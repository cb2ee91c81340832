"""The skill `speak` with the robot's real voice, with none, and with one that is broken off."""

from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest

from drivers.audio.base import AudioFormat, AudioOutput
from drivers.audio.espeak import EspeakEngine
from drivers.audio.wav import WavOutput
from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import Announcer, ClaimBook, SharedSpace
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import load_robot
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.skills.actions.simple import speak
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.link import SkillLink
from vla_deploy.speech.voice.robot_voice import RobotVoice

TEXT = "The red cup is in the box"


class Talk:
    """Step a skill and, unless it is silent, the voice that answers it."""

    def __init__(self, folder: Path) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.space = SharedSpace(folder / "ipc", self.clock)
        self.folder = folder
        self.shown: list[str] = []
        self.voice: RobotVoice | None = None
        self.has_speaker = True
        robot = load_robot("butler")
        self.context = SkillContext(
            robot=robot,
            link=SkillLink(self.space, self.clock, robot),
            planner=cast("PathPlanner", None),
            arms={},
            say=self.shown.append,
            voice=Announcer(self.space, "speak", self.clock),
            claims=ClaimBook(self.space, self.clock),
        )
        self.context.link.acting = "a1"

    def give_voice(self) -> None:
        self.voice = RobotVoice(EspeakEngine(), self._open, self.clock, InlineExecutor())
        self.voice.start(self.space)
        self.step_voice()

    def step_voice(self) -> None:
        self.clock.ns += NS_PER_S // 50
        if self.voice is not None:
            self.voice.step()
            status = {"voice": self.voice.document()}
            self.space.cell_writer("speech_status").put_document(status)

    def run(self, skill: Skill, at_most_s: float = 60.0) -> float:
        """Return for how long the skill went on."""
        began_ns = self.clock.ns
        for _ in skill:
            self.step_voice()
            assert self.clock.ns - began_ns < at_most_s * NS_PER_S
        return (self.clock.ns - began_ns) / NS_PER_S

    def _open(self) -> AudioOutput:
        if not self.has_speaker:
            raise DeviceMissing("sound device 'USB Audio': not there; plug it in")
        return WavOutput(self.folder / "said.wav", AudioFormat(rate_hz=16_000))


@pytest.fixture
def talk(tmp_path: Path) -> Iterator[Talk]:
    made = Talk(tmp_path)
    yield made
    if made.voice is not None:
        made.voice.close()
    made.space.close()


def test_speaking_takes_as_long_as_the_words(talk: Talk) -> None:
    talk.give_voice()
    took_s = talk.run(speak(talk.context, {"text": TEXT}))
    assert took_s == pytest.approx(EspeakEngine().synthesise(TEXT).duration_s, abs=0.2)
    assert (talk.shown, talk.context.notes) == ([TEXT], {})


def test_without_a_voice_it_goes_on_at_once_and_says_so(talk: Talk) -> None:
    assert talk.run(speak(talk.context, {"text": TEXT})) < 0.1
    assert talk.shown == [TEXT]
    assert talk.context.notes == {"a1": "shown, not spoken: no speech process runs"}


def test_without_a_speaker_it_goes_on_at_once_and_says_why(talk: Talk) -> None:
    talk.has_speaker = False
    talk.give_voice()
    assert talk.run(speak(talk.context, {"text": TEXT})) < 0.1
    assert "plug it in" in talk.context.notes["a1"]


def test_a_voice_that_is_interrupted_lets_the_plan_go_on_and_says_so(talk: Talk) -> None:
    talk.give_voice()
    skill = speak(talk.context, {"text": TEXT})
    for _ in range(20):
        next(skill)
        talk.step_voice()
    assert talk.voice is not None
    talk.voice.fall_silent("somebody spoke")
    talk.run(skill, at_most_s=0.2)
    assert "interrupted: somebody spoke" in talk.context.notes["a1"]


def test_a_voice_that_dies_is_waited_for_within_a_bound(talk: Talk) -> None:
    talk.give_voice()
    skill = speak(talk.context, {"text": TEXT})
    next(skill)
    assert talk.voice is not None
    talk.voice.close()
    talk.voice = None
    assert talk.run(skill) < 12.0
    assert "took longer than" in talk.context.notes["a1"]


def test_a_cancelled_speech_falls_silent(talk: Talk) -> None:
    talk.give_voice()
    skill = speak(talk.context, {"text": TEXT})
    for _ in range(20):
        next(skill)
        talk.step_voice()
    skill.close()
    talk.step_voice()
    told = talk.space.ring_reader("voice_event", from_start=True).drain()
    assert [one.payload["event"] for one in told] == ["began", "interrupted"]
