"""A spoken stop presses the button before its phrase has ended, once, and is no command."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from platforms import load_profile
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.speech.asr_pipeline import STOPPED, AsrPipeline, HeardPhrase
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.recording import StreamClock
from vla_deploy.speech.sound import FRAME, Playing, SoundBlock, duration_ns
from vla_deploy.speech.transcript import Transcript, confidence
from vla_deploy.speech.transcription_queue import TranscriptionQueue
from vla_deploy.speech.verdict import OWN_VOICE, PhraseVerdict
from vla_deploy.speech.voice_activity import VoiceActivity

LOUD = 0.25
UNSURE = -0.9
"""A mean log-probability that an unmeasured model is 0.35 sure by."""


class LoudnessVad:
    """Hear a voice wherever it is loud, in place of a network."""

    def probability(self, samples: Any) -> float:
        return 0.95 if np.abs(samples).max() >= LOUD else 0.02

    def reset(self) -> None:
        """Nothing is kept from frame to frame."""


class Reader:
    """Read more of a text the longer the sound is, in place of a network."""

    def __init__(self, words: str, log_probability: float) -> None:
        self._words = words.split()
        self._log_probability = log_probability

    def read(self, samples: Any) -> Transcript:
        voiced_s = float((np.abs(samples) >= LOUD).sum()) / 16_000
        read = Transcript(
            text=" ".join(self._words[: 1 + int(voiced_s / 0.3)]),
            log_probability=self._log_probability,
            no_speech=0.0,
            compression=1.0,
            language="en",
        )
        return replace(read, confidence=confidence(read, None))


def heard(
    words: str, voiced_s: float, log_probability: float = -0.1, playing: Playing | None = None
) -> list[tuple[float, HeardPhrase]]:
    """Return what is told of words that are spoken for so long, and when, from their beginning."""
    clock = StreamClock()
    queue = TranscriptionQueue(InlineExecutor(), clock)
    reader = cast("Recogniser", Reader(words, log_probability))
    queue.selected = SelectedRecogniser(recogniser=reader)
    activity = cast("VoiceActivity", LoudnessVad())
    asr = AsrPipeline(activity, queue, load_profile("desktop").speech)
    told: list[tuple[float, HeardPhrase]] = []
    tone = np.where(np.arange(FRAME) % 16 < 8, 1.0, -1.0).astype(np.float32)
    quiet, loud = 0.001 * tone, LOUD * tone
    frames = [quiet] * 30 + [loud] * round(voiced_s * 16_000 / FRAME) + [quiet] * 40
    for number, samples in enumerate(frames):
        block = SoundBlock(
            stamp_ns=duration_ns(number * FRAME), samples=samples, follows=number > 0
        )
        clock.ns = block.end_ns
        asr.feed(block, playing)
        told += [((number + 1 - 30) * FRAME / 16_000, one) for one in asr.heard()]
    return told


@pytest.mark.parametrize("log_probability", [-0.1, UNSURE])
def test_a_stop_is_told_in_the_pause_before_its_phrase_ends(log_probability: float) -> None:
    ((at_s, stop), (ended_s, after)) = heard("stop", 0.3, log_probability)
    assert (stop.judgement.verdict, stop.text) == (PhraseVerdict.STOP, "stop")
    assert at_s < 0.3 + 0.2 < ended_s
    assert (after.judgement.verdict, after.judgement.reason) == (PhraseVerdict.REJECTED, STOPPED)


def test_a_stop_word_among_others_stops_the_robot() -> None:
    told = heard("stop before you hit the chair now", 2.4)
    assert [one.judgement.verdict for _, one in told] == [
        PhraseVerdict.STOP,
        PhraseVerdict.REJECTED,
    ]
    assert told[0][1].text == "stop before you hit the chair now"


@pytest.mark.parametrize("words", ["stopped at the shop today with him", "take the cup to me now"])
def test_other_talk_is_told_once_at_its_end(words: str) -> None:
    ((at_s, one),) = heard(words, 2.4)
    assert at_s > 2.4
    assert (one.text, one.judgement.verdict) == (words, PhraseVerdict.ACCEPTED)


def test_a_stop_word_among_others_that_are_hardly_understood_stops_nothing() -> None:
    told = heard("take the stop to me now please", 2.4, UNSURE)
    assert [one.judgement.verdict for _, one in told] == [PhraseVerdict.DOUBTED]


def test_the_robots_own_stop_word_stops_nothing_while_no_person_is_known_to_speak() -> None:
    saying = Playing(say_id="s", text="I stop.", echo_db=-90.0)
    told = heard("stop", 0.1, playing=saying)
    assert [one.judgement.reason for _, one in told] in ([], [OWN_VOICE])
    told = heard("stop", 0.4, playing=saying)
    assert told[0][1].judgement.verdict is PhraseVerdict.STOP, "a person has barged in"
