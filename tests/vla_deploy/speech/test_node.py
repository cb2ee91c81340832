"""The speech process hears through its companions, and says why it cannot, whatever is missing."""

import dataclasses
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, AudioInput, Samples
from drivers.audio.espeak import EspeakEngine
from drivers.audio.pushed import PushedInput
from drivers.clock import NS_PER_S, MonotonicClock
from drivers.errors import DeviceMissing
from platforms import Profile, load_profile
from sim_twin.contracts.scripted import ManualClock
from sim_twin.sound.acoustics import Acoustics
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.page_sound import PageSound, SoundStep
from vla_deploy.robots import load_robot
from vla_deploy.runtime.node import NodeContext
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.sound import FRAME, Playing, SoundBlock
from vla_deploy.speech.voice.robot_voice import RobotVoice


class ScriptedVoice:
    """Say one thing for as long as the test wants, and keep why it fell silent."""

    def __init__(self) -> None:
        self.playing: Playing | None = None
        self.silenced: list[str] = []

    def start(self, space: SharedSpace) -> None:
        self.space = space

    def step(self) -> None:
        """Nothing is to be done: `playing` is what the test sets."""

    def cleaned(self, frame: SoundBlock) -> SoundBlock:
        return frame

    def fall_silent(self, reason: str) -> None:
        self.silenced.append(reason)

    def document(self) -> Mapping[str, Any]:
        return {}

    def close(self) -> None:
        self.playing = None


class Bench:
    """Step a node whose microphone is pushed, plugged in or not."""

    def __init__(
        self,
        context: NodeContext,
        clock: ManualClock,
        listener: Any,
        models: Path,
        format_: AudioFormat,
    ) -> None:
        self.clock = clock
        self.format = format_
        self.plugged = True
        self.turn = 0
        self.device: PushedInput | None = None
        self.listener = listener
        self.voice = ScriptedVoice()
        self.space = SharedSpace(context.run_dir / "ipc", clock)
        store = ModelStore(models, embedded=models / "none")
        self.node = SpeechNode(
            context,
            load_robot("butler"),
            load_profile("desktop"),
            self.open,
            voice=cast("RobotVoice", self.voice),
            stop_words=listener,
            shelf=ModelShelf(store=store, engines=models, clock=MonotonicClock()),
        )
        self._status = self.space.cell_reader("speech_status")
        topics = ("heard", "utterance", "say", "operator")
        self._rings = {name: self.space.ring_reader(name, from_start=True) for name in topics}
        self.node.start()

    def open(self) -> AudioInput:
        if not self.plugged:
            raise DeviceMissing("sound device 'ReSpeaker': not there; plug it in")
        self.device = PushedInput(self.format, self.clock)
        return self.device

    def plug(self) -> None:
        self.plugged, self.device = True, None

    def play(self, samples: Samples) -> None:
        """Let a microphone hear samples as time passes, a step every 20 ms."""
        size = self.format.rate_hz // 50
        for at in range(0, len(samples), size):
            self.clock.ns += NS_PER_S // 50
            if self.device is not None and self.plugged:
                self.device.push(samples[at : at + size])
            self.node.step()

    def quiet(self, seconds: float) -> None:
        """Let the microphone hear its own faint noise."""
        noise = np.random.default_rng(1).standard_normal(
            (round(seconds * self.format.rate_hz), self.format.channels)
        )
        self.play(np.rint(8.0 * noise).astype(np.int16))

    def say(self, text: str, gain: float = 1.0, voice: str = "en-gb") -> None:
        """Let a person in the room say something, and a second pass."""
        talker = Talker(engine=EspeakEngine(voice=voice))
        wave = arrival(text, talker, self.format.rate_hz, Acoustics()).sound.wave
        samples = (gain * 32_768 * wave).clip(-32_768, 32_767).astype(np.int16)
        self.play(np.repeat(samples[:, None], self.format.channels, axis=1))
        self.quiet(1.0)

    def hold(
        self,
        text: str,
        last: SoundStep | None = SoundStep.ENDED,
        rate_hz: int = 48_000,
        share: float = 1.0,
    ) -> None:
        """Let a person say something into the page, or a share of it, as fast as they speak."""
        wave = arrival(text, Talker(engine=EspeakEngine()), rate_hz, Acoustics()).sound.wave
        samples = (32_768 * wave).clip(-32_768, 32_767).astype(np.int16)
        samples = samples[: round(share * len(samples))]
        records = self.space.record_writer("page_sound")
        self.turn += 1
        turn, size = self.turn, rate_hz // 10
        for at in range(0, len(samples), size):
            sound = PageSound(
                turn=turn, rate_hz=rate_hz, step=SoundStep.SOUND, samples=samples[at : at + size]
            )
            records.append(sound.packed())
            self.quiet(0.1)
        if last is not None:
            records.append(PageSound(turn=turn, rate_hz=rate_hz, step=last).packed())

    def told(self, topic: str) -> list[dict[str, Any]]:
        return [dict(event.payload) for event in self._rings[topic].drain()]

    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()


MakeBench = Callable[..., Bench]
TEXT = "pick up the red cup"


@pytest.fixture
def bench(context: NodeContext, clock: ManualClock, listener: Any, scripted_whisper: Any) -> Any:
    made: list[Bench] = []

    def make(
        rate_hz: int = 16_000, channels: int = 1, *, text: str = TEXT, sureness: float = 30.0
    ) -> Bench:
        scripted_whisper.model("commands-whisper", text, sureness)
        format_ = AudioFormat(rate_hz=rate_hz, channels=channels)
        made.append(Bench(context, clock, listener, scripted_whisper.folder, format_))
        made[0].node.step()
        return made[0]

    yield make
    made[0].node.stop()
    assert listener.closed == 1


@pytest.fixture
def rig(bench: MakeBench) -> Bench:
    """Return the bench of a node that has heard a second of a quiet room."""
    rig = bench()
    rig.quiet(1.0)
    return rig


def test_a_listener_hears_every_block_in_time_at_16_khz(bench: MakeBench, tone: Any) -> None:
    rig = bench(rate_hz=48_000)
    rig.play(tone(1.0, rate_hz=48_000))
    blocks = rig.listener.blocks
    assert sum(len(block.samples) for block in blocks) == pytest.approx(16_000, abs=FRAME)
    assert [block.follows for block in blocks] == [False] + 30 * [True]
    assert blocks[-1].end_ns == pytest.approx(rig.clock.ns, abs=32_000_000)
    assert rig.status()["state"] == "listening"
    assert rig.status()["stop_words"]["blocks"] > 0


def test_a_microphone_that_is_unplugged_is_told_and_heard_again_when_it_is_back(
    bench: MakeBench, tone: Any
) -> None:
    rig = bench()
    rig.plugged = False
    rig.play(tone(4.0))
    assert (rig.status()["state"], rig.listener.blocks) == ("deaf", [])
    assert "plug it in" in rig.status()["why"]
    rig.plug()
    rig.play(tone(5.0))
    assert rig.status()["state"] == "listening"
    heard = len(rig.listener.blocks)
    rig.plugged = False
    rig.play(tone(4.0))
    assert rig.status()["state"] == "deaf"
    rig.plug()
    rig.play(tone(5.0))
    assert rig.status()["state"] == "listening"
    assert not rig.listener.blocks[heard].follows


def test_a_robot_without_a_microphone_says_so_and_runs(context: NodeContext) -> None:
    node = SpeechNode(context, load_robot("butler"), load_profile("desktop"), None)
    node.start()
    node.step()
    status = SharedSpace(context.run_dir / "ipc", context.clock).cell_reader("speech_status")
    told = status.latest()
    assert told is not None
    assert told.document()["why"] == "robot butler has no [microphone]"
    node.stop()


def test_a_missing_extra_is_told_in_words(
    bench: MakeBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    rig = bench(rate_hz=48_000)
    assert rig.status()["state"] == "deaf"
    assert "pip install 'vla-deploy[speech]'" in rig.status()["why"]


@pytest.mark.parametrize(("rate_hz", "channels"), [(16_000, 1), (48_000, 2)])
def test_a_spoken_command_becomes_an_utterance_soon_after_its_last_word(
    bench: MakeBench, rate_hz: int, channels: int
) -> None:
    rig = bench(rate_hz, channels)
    rig.quiet(1.0)
    rig.say(TEXT)
    (utterance,) = rig.told("utterance")
    assert (utterance["text"], utterance["source"]) == (TEXT, "voice")
    assert utterance["heard"]["confidence"] > 0.8
    (heard,) = rig.told("heard")
    assert 0 < heard["told_ns"] - heard["ended_ns"] < 300_000_000
    status = rig.status()
    assert (status["state"], status["why"]) == ("listening", "")
    assert (status["heard"]["accepted"], status["model"]["name"]) == (1, "commands-whisper")


def test_silence_noise_and_music_say_nothing(bench: MakeBench) -> None:
    rig = bench()
    rig.quiet(3.0)
    loud = np.random.default_rng(2).standard_normal((5 * 16_000, 1))
    rig.play((3_000 * loud).astype(np.int16))
    time_s = np.arange(6 * 16_000) / 16_000
    tones = sum(np.sin(2 * np.pi * hz * time_s) for hz in (220, 277, 330, 440))
    rig.play((2_000 * tones).astype(np.int16)[:, None])
    rig.quiet(2.0)
    assert rig.told("utterance") == rig.told("say") == []
    assert [one["verdict"] for one in rig.told("heard") if one["verdict"] != "rejected"] == []


def test_an_unsure_reading_is_asked_again_and_never_carried_out(bench: MakeBench) -> None:
    rig = bench(sureness=0.6)
    rig.quiet(1.0)
    rig.say("quelle heure est il maintenant", voice="fr")
    rig.say(TEXT)
    french, english = rig.told("heard")
    assert french["verdict"] == english["verdict"] == "rejected"
    assert "at least 50% is needed" in french["reason"]
    assert rig.told("utterance") == rig.told("operator") == []
    (asked,) = rig.told("say")
    assert "say it again" in asked["text"], "once, not for each"


def test_a_long_talk_without_a_pause_is_refused_once(bench: MakeBench) -> None:
    rig = bench()
    changed = short_phrases(load_profile("desktop"))
    rig.node.commit(rig.node.prepare(changed, 0))
    assert rig.listener.settings is changed.speech
    rig.quiet(1.0)
    rig.say("and so we went on and on and never came to the end of what there was to say at all")
    (heard,) = rig.told("heard")
    assert heard["reason"] == "2 s of talk are no command"
    assert rig.told("utterance") == rig.told("say") == []


def short_phrases(profile: Profile) -> Profile:
    return dataclasses.replace(
        profile, speech=dataclasses.replace(profile.speech, longest_phrase_s=2.0)
    )


def test_a_spoken_stop_presses_the_button(bench: MakeBench) -> None:
    rig = bench(text="stop")
    rig.quiet(1.0)
    rig.say("stop")
    (press,) = rig.told("operator")
    assert press == {"act": "estop", "source": "voice", "reason": 'heard "stop"'}
    assert rig.told("utterance") == rig.told("say") == []
    assert rig.told("heard")[0]["verdict"] == "stop"


def test_a_phrase_that_a_listener_has_taken_is_no_command(bench: MakeBench) -> None:
    rig = bench()
    rig.listener.refusal = "'stop' was heard in it"
    rig.quiet(1.0)
    rig.say(TEXT)
    (heard,) = rig.told("heard")
    assert (heard["verdict"], heard["reason"]) == ("rejected", "'stop' was heard in it")
    assert rig.told("utterance") == rig.told("say") == []


def test_the_robot_does_not_heed_itself_but_a_person_who_speaks_into_it(bench: MakeBench) -> None:
    rig = bench(text="come here")
    rig.quiet(1.0)
    rig.voice.playing = Playing(say_id="s1", text="I will pick up the cup", echo_db=-20.0)
    rig.say("I will pick up the cup and bring it to you right now", gain=0.3)
    assert rig.told("heard") == []
    assert rig.voice.silenced == []
    assert rig.status()["speaking"] is True
    heard_by_listeners = len(rig.listener.blocks)
    rig.say("robot come over here to me please", gain=4.0)
    assert rig.voice.silenced == ["somebody spoke"]
    assert [one["text"] for one in rig.told("utterance")] == ["come here"]
    assert len(rig.listener.blocks) > heard_by_listeners, "stop words stay live"


def test_without_a_model_the_robot_is_deaf_and_says_so_for_each_phrase(
    context: NodeContext, clock: ManualClock, listener: Any, tmp_path: Path
) -> None:
    rig = Bench(context, clock, listener, tmp_path / "nothing", AudioFormat(rate_hz=16_000))
    rig.node.step()
    rig.quiet(1.0)
    rig.say(TEXT)
    status = rig.status()
    assert status["state"] == "deaf"
    assert status["why"].startswith("no model: commands-whisper is not here")
    (heard,) = rig.told("heard")
    assert heard["verdict"] == "rejected"
    assert heard["reason"].startswith("no model turns speech into text")
    assert rig.told("utterance") == []
    rig.node.stop()


def test_another_profile_brings_another_model_and_the_way_back(
    bench: MakeBench, scripted_whisper: Any
) -> None:
    rig = bench()
    scripted_whisper.model("other", "turn left")
    profile = load_profile("desktop")
    choice = dataclasses.replace(profile.models["speech_to_text"], tiers=("other",))
    other = dataclasses.replace(profile, models={"speech_to_text": choice})
    before = rig.node.commit(rig.node.prepare(other, 0))
    rig.quiet(1.0)
    rig.say("turn left")
    assert [one["text"] for one in rig.told("utterance")] == ["turn left"]
    rig.node.discard(rig.node.commit(before))
    rig.say(TEXT)
    assert [one["text"] for one in rig.told("utterance")] == [TEXT]


def test_a_sentence_that_cannot_be_all_is_waited_for(bench: MakeBench) -> None:
    rig = bench(text="pick up the")
    rig.quiet(1.0)
    rig.say("pick up the")
    (heard,) = rig.told("heard")
    waited_s = (heard["told_ns"] - heard["ended_ns"]) / NS_PER_S
    settings = load_profile("desktop").speech
    assert settings.end_silence_s + 0.1 < waited_s < settings.unfinished_silence_s + 0.1


@pytest.mark.parametrize("rate_hz", [16_000, 48_000])
def test_what_is_said_into_the_page_is_understood_as_soon_as_the_button_is_let_go(
    rig: Bench, rate_hz: int
) -> None:
    rig.hold(TEXT, rate_hz=rate_hz)
    rig.quiet(0.1)
    assert [one["text"] for one in rig.told("utterance")] == [TEXT]


@pytest.mark.parametrize(("last", "quiet_s"), [(SoundStep.CUT, 3.0), (None, 4.0)])
def test_a_phrase_that_is_cut_off_or_not_ended_is_not_carried_out(
    rig: Bench, last: SoundStep | None, quiet_s: float
) -> None:
    rig.hold(TEXT, last=last, share=0.5)
    rig.quiet(quiet_s)
    assert rig.told("heard") == rig.told("utterance") == []
    rig.say(TEXT)
    assert len(rig.told("utterance")) == 1, "the robot's own ears hear again"


def test_while_a_person_speaks_into_the_page_the_room_is_heard_for_stop_words_only(
    rig: Bench,
) -> None:
    records, heard = rig.space.record_writer("page_sound"), len(rig.listener.blocks)
    silence = np.zeros(1600, np.int16)
    sound = PageSound(turn=9, rate_hz=16_000, step=SoundStep.SOUND, samples=silence).packed()
    for _ in range(3):
        records.append(sound)
        rig.say(TEXT)
    assert rig.told("heard") == []
    assert len(rig.listener.blocks) - heard > 100


def test_the_robot_falls_silent_for_whoever_holds_the_button(rig: Bench) -> None:
    question = f"Shall I {TEXT}, or the blue one?"
    rig.voice.playing = Playing(say_id="1", text=question, echo_db=-38.0)
    rig.hold(TEXT)
    rig.quiet(0.1)
    assert rig.voice.silenced == ["somebody spoke"]
    assert [one["text"] for one in rig.told("utterance")] == [TEXT]


def test_without_pyav_a_turn_at_another_rate_is_told_and_dropped(
    rig: Bench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    rig.hold(TEXT)
    rig.quiet(0.5)
    assert caplog.text.count("pip install") == 1
    assert rig.told("utterance") == []
