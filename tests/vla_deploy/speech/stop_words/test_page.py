"""A stop word said into the page stops the robot at once, by a listener of the page's own."""

import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import Samples
from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.contracts.scripted import ManualClock
from sim_twin.sound.acoustics import Acoustics
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.inference.manifest import Manifest
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.page_sound import PageSound, SoundStep
from vla_deploy.robots import load_robot
from vla_deploy.runtime.node import NodeContext
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.sound import SoundBlock, duration_ns
from vla_deploy.speech.stop_words.listener import PAGE, StopWords, build_stop_words
from vla_deploy.speech.stop_words.spotter import Spotter

RATE_HZ = 16_000
NORMAL = dataclasses.replace(load_profile("desktop").speech, stop_words="normal")


class Page:
    """Hold a page's button of a robot that has no microphone, and speak."""

    def __init__(self, context: NodeContext, clock: ManualClock, listener: StopWords) -> None:
        self.clock = clock
        self.space = SharedSpace(context.run_dir / "ipc", clock)
        self.acts = self.space.ring_reader("operator", from_start=True)
        self.heard = self.space.ring_reader("heard", from_start=True)
        self._status = self.space.cell_reader("speech_status")
        self.node = SpeechNode(
            context,
            load_robot("butler"),
            load_profile("desktop"),
            None,
            page_stop_words=listener,
        )
        self.node.start()

    def say(self, samples: Samples, last: SoundStep | None = None) -> None:
        """Send samples as fast as they are spoken; the button stays held unless `last` is told."""
        records = self.space.record_writer("page_sound")
        for at in range(0, len(samples), RATE_HZ // 10):
            part = samples[at : at + RATE_HZ // 10]
            sound = PageSound(turn=1, rate_hz=RATE_HZ, step=SoundStep.SOUND, samples=part)
            records.append(sound.packed())
            self.wait(0.1)
        if last is not None:
            records.append(PageSound(turn=1, rate_hz=RATE_HZ, step=last).packed())
            self.wait(0.1)

    def wait(self, seconds: float) -> None:
        for _ in range(round(50 * seconds)):
            self.clock.ns += NS_PER_S // 50
            self.node.step()

    def presses(self) -> list[dict[str, Any]]:
        return [dict(event.payload) for event in self.acts.drain()]

    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()


MakePage = Callable[[StopWords], Page]


@pytest.fixture
def page(context: NodeContext, clock: ManualClock) -> Iterator[MakePage]:
    made: list[Page] = []

    def make(listener: StopWords) -> Page:
        made.append(Page(context, clock, listener))
        return made[0]

    yield make
    made[0].node.stop()
    made[0].space.close()


@pytest.fixture
def listener(clock: ManualClock, spotter: Spotter) -> StopWords:
    return StopWords(lambda: spotter, NORMAL, clock, place=PAGE)


def loud(seconds: float) -> Samples:
    wave = np.random.default_rng(0).normal(0.0, 0.3, round(seconds * RATE_HZ))
    return (32_767 * wave.clip(-1.0, 1.0)).astype(np.int16)


def test_the_shipped_model_hears_a_stop_before_the_button_is_let_go(
    page: MakePage, context: NodeContext
) -> None:
    held = page(build_stop_words(context, load_profile("desktop"), place=PAGE))
    talker = Talker(engine=EspeakEngine(voice="en-us"))
    wave = arrival("stop", talker, RATE_HZ, Acoustics()).sound.wave
    held.say((32_767 * wave.clip(-1.0, 1.0)).astype(np.int16))
    spotted = {"act": "estop", "source": "page_voice", "reason": "heard 'stop'"}
    assert spotted in held.presses()


def test_the_phrase_that_held_it_is_no_command_and_the_status_tells_it(
    page: MakePage, listener: StopWords
) -> None:
    held = page(listener)
    held.say(loud(0.4))
    assert [act["source"] for act in held.presses()] == ["page_voice"]
    held.say(np.zeros(RATE_HZ // 2, np.int16), last=SoundStep.ENDED)
    assert [event.payload["verdict"] for event in held.heard.drain()] == ["stop"]
    assert held.status()["page_stop_words"]["state"] == "live"


def test_half_a_word_of_a_turn_that_was_cut_off_does_not_count_in_the_next(
    page: MakePage, listener: StopWords
) -> None:
    held = page(listener)
    for _ in range(5):
        held.say(loud(0.04), last=SoundStep.CUT)
    assert held.presses() == []


def test_two_listeners_keep_their_states_apart(
    tmp_path: Path, clock: ManualClock, scorer: Any, manifest: Manifest
) -> None:
    space = SharedSpace(tmp_path / "ipc", clock)
    acts = space.ring_reader("operator", from_start=True)
    room, page = Spotter(scorer, manifest), Spotter(scorer, manifest)
    listeners = (
        StopWords(lambda: room, NORMAL, clock),
        StopWords(lambda: page, NORMAL, clock, place=PAGE),
    )
    for listener in listeners:
        listener.start(space)
    in_room, in_page = listeners
    sound = (loud(0.4)[: 10 * 512] / 32_768).astype(np.float32)
    for at in range(0, len(sound), 512):
        in_room.feed(SoundBlock(stamp_ns=clock.ns, samples=sound[at : at + 512]))
        in_page.feed(SoundBlock(stamp_ns=clock.ns, samples=np.zeros(512, np.float32)))
        clock.ns += duration_ns(512)
    assert room.runs == page.runs > 0
    assert [event.payload["source"] for event in acts.drain()] == ["voice"]
    for listener in listeners:
        listener.close()
    space.close()
