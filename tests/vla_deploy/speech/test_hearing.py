"""A spoken stop presses the button before its phrase has ended, once, and is no command."""

from collections import deque
from typing import Any, cast

import numpy as np
import pytest

from platforms import load_profile
from vla_deploy.aside import AtOnce
from vla_deploy.inference.manifest import Context, Whisper
from vla_deploy.speech.hearing import STOPPED, Heard, Hearing, Suspicion, unsuspected
from vla_deploy.speech.reading import Alternative, Reading
from vla_deploy.speech.readings import Readings
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.recording import StreamClock
from vla_deploy.speech.sound import SoundBlock, duration_ns
from vla_deploy.speech.verdict import Verdict
from vla_deploy.speech.voice_activity import FRAME, VoiceActivity

LOUD = 0.25


class Ear:
    """Hear a voice wherever it is loud, in place of a network."""

    def probability(self, samples: Any) -> float:
        return 0.95 if np.abs(samples).max() >= LOUD else 0.02

    def reset(self) -> None:
        """Nothing is kept from frame to frame."""


class Reader:
    """Read more of a text the longer the sound is, in place of a network."""

    def __init__(
        self, words: str, log_probability: float, others: tuple[Alternative, ...] = ()
    ) -> None:
        self.declared = Whisper(languages=("en",), context=Context.TRIMMED, hot_words=False)
        self.lately_ns: deque[int] = deque()
        self._words = words.split()
        self._log_probability = log_probability
        self._others = others

    def read(self, samples: Any, _hot_words: str, _earlier: Any) -> Reading:
        voiced_s = float((np.abs(samples) >= LOUD).sum()) / 16_000
        return Reading(
            text=" ".join(self._words[: 1 + int(voiced_s / 0.3)]),
            log_probability=self._log_probability,
            no_speech=0.0,
            compression=1.0,
            language="en",
            duration_s=1.0,
            took_s=0.0,
            others=self._others,
        )


def heard(
    words: str,
    voiced_s: float,
    log_probability: float = -0.1,
    others: tuple[Alternative, ...] = (),
    suspicion: Suspicion = unsuspected,
) -> list[tuple[float, Heard]]:
    """Return what is told of words that are spoken for so long, and when, from their beginning."""
    clock = StreamClock()
    readings = Readings(AtOnce(), clock)
    readings.take(cast("Recogniser", Reader(words, log_probability, others)), "")
    activity = cast("VoiceActivity", Ear())
    settings = load_profile("desktop").speech
    hearing = Hearing(activity, readings, settings, lambda: "", suspicion)
    told: list[tuple[float, Heard]] = []
    tone = np.where(np.arange(FRAME) % 16 < 8, 1.0, -1.0).astype(np.float32)
    quiet, loud = 0.001 * tone, LOUD * tone
    frames = [quiet] * 30 + [loud] * round(voiced_s * 16_000 / FRAME) + [quiet] * 40
    for number, samples in enumerate(frames):
        block = SoundBlock(
            stamp_ns=duration_ns(number * FRAME), samples=samples, follows=number > 0
        )
        clock.ns = block.end_ns
        hearing.feed(block, None)
        told += [((number + 1 - 30) * FRAME / 16_000, one) for one in hearing.heard()]
    return told


def test_a_stop_is_told_in_the_pause_before_its_phrase_ends() -> None:
    ((at_s, stop), (ended_s, after)) = heard("stop", 0.3)
    assert (stop.judgement.verdict, stop.text) == (Verdict.STOP, "stop")
    assert at_s < 0.3 + 0.2 < ended_s
    assert (after.judgement.verdict, after.judgement.reason) == (Verdict.REJECTED, STOPPED)


def test_a_stop_is_told_while_the_speaker_goes_on() -> None:
    told = heard("stop before you hit the chair now", 2.4)
    assert [one.judgement.verdict for _, one in told] == [Verdict.STOP, Verdict.REJECTED]
    assert told[0][0] < 1.0, "long before the end"
    assert told[1][1].text == "stop before you hit the chair now"


def test_an_unsure_stop_is_told_after_a_second_look_before_its_phrase_is() -> None:
    ((at_s, stop), (ended_s, after)) = heard("halt", 0.3, log_probability=-0.9)
    assert (stop.judgement.verdict, stop.text) == (Verdict.STOP, "halt")
    assert 0.3 + 0.2 < at_s < 0.3 + 0.3
    assert at_s <= ended_s
    assert after.judgement.reason == STOPPED


@pytest.mark.parametrize("words", ["stopped at the shop today with him", "take the cup to me now"])
def test_other_talk_is_told_once_at_its_end(words: str) -> None:
    ((at_s, one),) = heard(words, 2.4)
    assert at_s > 2.4
    assert (one.text, one.judgement.verdict) == (words, Verdict.ACCEPTED)


def test_what_is_hardly_understood_stops_nothing_while_the_speaker_goes_on() -> None:
    told = heard("take the stop to me now please", 2.4, log_probability=-0.9)
    assert [one.judgement.verdict for _, one in told] == [Verdict.DOUBTED]


def suspecting(ratio: float) -> Suspicion:
    return lambda began_ns, ended_ns: ratio


@pytest.mark.parametrize(("ratio", "odds", "stops"), [
    (0.5, 0.45, True), (0.25, 0.45, False), (0.5, 0.35, False),
])  # fmt: skip
def test_a_phrase_that_was_hardly_likelier_another_one_than_a_stop_is_one(
    ratio: float, odds: float, stops: bool
) -> None:
    told = heard("hope", 0.3, others=(Alternative("halt", odds),), suspicion=suspecting(ratio))
    assert (told[0][1].judgement.verdict is Verdict.STOP) is stops


def test_what_the_spotter_suspects_and_the_recogniser_may_have_read_is_a_stop() -> None:
    within = (Alternative("please halt before the chair", 0.5),)
    plain = heard("please hold before the chair", 1.2, others=within)
    assert [one.judgement.verdict for _, one in plain] == [Verdict.ACCEPTED]
    told = heard("please hold before the chair", 1.2, others=within, suspicion=suspecting(0.75))
    assert told[0][1].judgement.verdict is Verdict.STOP


def test_a_suspicion_alone_stops_nothing() -> None:
    told = heard("please hold the chair", 1.2, suspicion=suspecting(0.9))
    assert [one.judgement.verdict for _, one in told] == [Verdict.ACCEPTED]


def test_a_suspicion_that_comes_after_the_reading_still_counts() -> None:
    asked: list[int] = []

    def later(_began_ns: int, _ended_ns: int) -> float:
        asked.append(1)
        return 0.8 if len(asked) > 2 else 0.0

    told = heard("hey hold it there", 1.2, others=(Alternative("hey halt", 0.5),), suspicion=later)
    assert told[0][1].judgement.verdict is Verdict.STOP
    assert told[0][0] < 1.2, "while the speaker goes on"
