"""A stop word presses the button at once; whatever keeps it from being heard is told loudly."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from platforms import SpeechSettings, load_profile
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.ipc import SharedSpace
from vla_deploy.speech.sound import RATE_HZ, Playing, SoundBlock, duration_ns
from vla_deploy.speech.stop_words.listener import StopState, StopWords
from vla_deploy.speech.stop_words.spotter import Spotter

BLOCK = 512


def settings(sensitivity: str) -> SpeechSettings:
    return dataclasses.replace(load_profile("desktop").speech, stop_words=sensitivity)


class Ear:
    """Feed a listener block by block, and read what control and others are told."""

    def __init__(self, path: Path, clock: ManualClock, open_spotter: Any) -> None:
        self.clock = clock
        self.playing: Playing | None = None
        self.space = SharedSpace(path / "ipc", clock)
        self.acts = self.space.ring_reader("operator", from_start=True)
        self.heard = self.space.ring_reader("heard", from_start=True)
        self._open_spotter = open_spotter

    def listen(self, sensitivity: str = "normal") -> StopWords:
        self.listener = StopWords(self._open_spotter, settings(sensitivity), self.clock)
        self.listener.start(self.space)
        return self.listener

    def hear(self, duration_s: float, level: float, *, follows: bool = True) -> None:
        random = np.random.default_rng(0)
        for _ in range(round(duration_s * RATE_HZ / BLOCK)):
            samples = random.normal(0.0, level, BLOCK).astype(np.float32)
            block = SoundBlock(stamp_ns=self.clock.ns, samples=samples, follows=follows)
            self.clock.ns += duration_ns(BLOCK)
            self.listener.feed(block, self.playing)

    def word(self) -> None:
        self.hear(0.3, 0.3)
        self.hear(1.5, 0.0)

    def presses(self) -> list[dict[str, Any]]:
        return [dict(event.payload) for event in self.acts.drain()]


@pytest.fixture
def ear(tmp_path: Path, clock: ManualClock, spotter: Spotter) -> Iterator[Ear]:
    ear = Ear(tmp_path, clock, lambda: spotter)
    yield ear
    ear.listener.close()
    ear.space.close()


def test_a_stop_word_presses_the_button_before_the_phrase_ends(ear: Ear) -> None:
    ear.listen()
    ear.hear(3.0, 0.0)
    assert ear.presses() == []
    ear.hear(0.2, 0.3)  # and the speaker goes on
    (act,) = ear.presses()
    assert act == {"act": "estop", "source": "voice", "reason": "heard 'stop'"}
    (told,) = ear.heard.drain()
    assert (told.payload["verdict"], told.payload["text"]) == ("stop", "stop")


@pytest.mark.parametrize(("sensitivity", "presses"), [("high", 1), ("normal", 1), ("low", 0)])
def test_the_profiles_one_threshold_decides(ear: Ear, sensitivity: str, presses: int) -> None:
    ear.listen(sensitivity)
    ear.word()
    assert len(ear.presses()) == presses


def test_the_phrase_that_held_the_word_is_known_afterwards(ear: Ear) -> None:
    listener = ear.listen()
    ear.hear(1.0, 0.0)
    began_ns = ear.clock.ns
    ear.hear(0.4, 0.3)
    ended_ns = ear.clock.ns
    ear.hear(2.0, 0.0)
    assert "'stop' was heard" in listener.refuses(began_ns, ended_ns)
    assert listener.refuses(0, began_ns - NS_PER_S) == ""
    assert listener.refuses(ended_ns, ear.clock.ns) == ""


def speaking(text: str, say_id: str = "a") -> Playing:
    return Playing(say_id=say_id, text=text, echo_db=-38.0)


@pytest.mark.parametrize(
    "text", ["I am on my way to the kitchen", "I have stopped at the bus-stopping place"]
)
def test_it_stays_live_while_the_robot_says_anything_else(ear: Ear, text: str) -> None:
    ear.listen()
    ear.playing = speaking(text)
    ear.word()
    assert len(ear.presses()) == 1


def test_a_stop_word_of_its_own_is_taken_off_once_and_the_next_one_counts(ear: Ear) -> None:
    ear.listen()
    ear.playing = speaking("All right, I stop.")
    ear.word()
    assert ear.presses() == []
    ear.word()
    assert len(ear.presses()) == 1


def test_what_the_robot_said_before_takes_nothing_off_later(ear: Ear) -> None:
    ear.listen()
    ear.playing = speaking("stop")
    ear.hear(0.1, 0.0)
    ear.playing = None
    ear.hear(1.0, 0.0)
    ear.word()
    assert len(ear.presses()) == 1


def test_a_break_in_the_stream_begins_anew(ear: Ear, scorer: Any) -> None:
    ear.listen()
    ear.hear(0.032, 0.3)
    for _ in range(10):
        ear.hear(0.032, 0.3, follows=False)
    assert ear.presses() == []


def test_switched_off_it_says_so_and_hears_nothing(
    ear: Ear, caplog: pytest.LogCaptureFixture
) -> None:
    listener = ear.listen("off")
    ear.word()
    assert ear.presses() == []
    assert listener.state is StopState.OFF
    assert "speech.stop_words" in listener.document()["why"]
    assert "nobody can stop the robot by voice" in caplog.text


def test_another_profile_switches_it_on_and_off_while_it_runs(ear: Ear) -> None:
    listener = ear.listen("off")
    listener.adopt(settings("normal"))
    ear.word()
    assert len(ear.presses()) == 1
    listener.adopt(settings("off"))
    ear.word()
    assert (ear.presses(), listener.state) == ([], StopState.OFF)


def test_without_its_model_it_says_so_and_the_node_goes_on(
    tmp_path: Path, clock: ManualClock, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse() -> Any:
        raise ModelUnknown("no model 'stop_words'")

    ear = Ear(tmp_path, clock, refuse)
    listener = ear.listen()
    ear.word()
    assert listener.document()["state"] == "broken"
    assert listener.document()["why"] == "no model 'stop_words'"
    assert "nobody can stop the robot by voice" in caplog.text
    listener.close()


def test_a_model_that_fails_under_way_is_told_until_it_runs_again(
    ear: Ear, scorer: Any, caplog: pytest.LogCaptureFixture
) -> None:
    listener = ear.listen()
    scorer.is_broken = True
    ear.hear(0.5, 0.0)
    assert listener.document()["state"] == "broken"
    assert caplog.text.count("nobody can stop the robot by voice") == 1
    scorer.is_broken = False
    ear.word()
    assert listener.state is StopState.LIVE
    assert len(ear.presses()) == 1
