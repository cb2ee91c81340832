"""Phrases begin and end where somebody speaks, whatever the length of pauses and of talk."""

import numpy as np
import pytest

from platforms import SpeechSettings
from vla_deploy.speech.endpointing import Endpointer, VadEvent
from vla_deploy.speech.sound import FRAME, FRAME_S, Framer, SoundBlock, duration_ns, level_db

SETTINGS = SpeechSettings(
    shortest_phrase_s=0.2,
    longest_phrase_s=4.0,
    end_silence_s=0.32,
    unfinished_silence_s=0.96,
    pre_roll_s=0.32,
    beam=1,
    least_confidence=0.5,
    stop_words="normal",
)


class Stream:
    """Feed a scene of voice (v), silence (.) and murmur below the onset (m), 32 ms a letter."""

    def __init__(self) -> None:
        self.phrases = Endpointer(SETTINGS)
        self.at = 0

    def play(self, scene: str) -> list[VadEvent]:
        found: list[VadEvent] = []
        for letter in scene:
            frame = SoundBlock(
                stamp_ns=duration_ns(self.at * FRAME),
                samples=np.full(FRAME, 0.1, np.float32),
                follows=True,
            )
            self.at += 1
            voice = {"v": 0.95, ".": 0.02, "m": 0.47}[letter]
            found += self.phrases.feed(frame, voice)
        return found


def steps(found: list[VadEvent]) -> list[str]:
    return [kind.name for kind, _ in found]


def test_a_phrase_is_its_voice_with_what_came_before_and_a_pause_after() -> None:
    stream = Stream()
    found = stream.play(20 * "." + 30 * "v" + 20 * ".")
    assert steps(found) == ["PAUSED", "ENDED"]
    phrase = found[-1][1]
    assert phrase.began_ns == duration_ns(20 * FRAME)
    assert phrase.ended_ns == duration_ns(50 * FRAME)
    assert len(phrase.samples) == (10 + 30 + 10) * FRAME, "pre-roll, voice, silence"
    assert not stream.phrases.is_open


def test_a_murmur_keeps_a_phrase_open_and_begins_none() -> None:
    stream = Stream()
    assert stream.play(100 * "m") == []
    assert steps(stream.play("vvmmmmmmmmmmmmmmmmmmmmvv" + 10 * ".")) == ["PAUSED", "ENDED"]


def test_a_speaker_who_goes_on_after_a_short_pause_says_one_phrase() -> None:
    found = Stream().play(20 * "v" + 8 * "." + 20 * "v" + 12 * ".")
    assert steps(found) == ["PAUSED", "RESUMED", "PAUSED", "ENDED"]
    assert found[-1][1].ended_ns - found[-1][1].began_ns == duration_ns(48 * FRAME)


def test_an_unfinished_sentence_is_waited_for_in_this_pause_only() -> None:
    stream = Stream()
    assert steps(stream.play(20 * "v" + 6 * ".")) == ["PAUSED"]
    stream.phrases.wait_longer()
    assert stream.play(20 * ".") == []
    assert steps(stream.play(20 * "v" + 10 * ".")) == ["RESUMED", "PAUSED", "ENDED"]


def test_an_unfinished_sentence_that_stays_so_ends_all_the_same() -> None:
    stream = Stream()
    stream.play(20 * "v" + 6 * ".")
    stream.phrases.wait_longer()
    assert steps(stream.play(24 * ".")) == ["ENDED"]


def test_a_click_is_no_word() -> None:
    found = Stream().play(20 * "." + "vvv" + 20 * ".")
    assert steps(found) == ["PAUSED", "TOO_SHORT"]


def test_ten_minutes_of_talk_are_refused_once_and_cost_no_memory() -> None:
    stream = Stream()
    found = stream.play(round(600 / FRAME_S) * "v")
    assert steps(found) == ["TOO_LONG"]
    assert len(found[-1][1].samples) * 1.0 <= (SETTINGS.longest_phrase_s + FRAME_S) * 16_000
    assert stream.play(20 * ".") == [], "a pause of a breath is still the same talk"
    assert steps(stream.play(20 * "v" + 40 * "." + 20 * "v" + 12 * ".")) == [
        "PAUSED",
        "ENDED",
    ]


def test_a_gap_in_the_stream_forgets_what_was_begun() -> None:
    stream = Stream()
    stream.play(20 * "v")
    stream.phrases.reset()
    assert not stream.phrases.is_open
    assert stream.play(20 * ".") == []


def test_blocks_of_any_length_become_frames_in_time() -> None:
    framing = Framer()
    sound = np.arange(5_000, dtype=np.float32)
    frames: list[SoundBlock] = []
    for at in range(0, 5_000, 333):
        block = SoundBlock(stamp_ns=duration_ns(at), samples=sound[at : at + 333], follows=at > 0)
        frames += framing.feed(block)
    assert np.array_equal(np.concatenate([one.samples for one in frames]), sound[: 9 * FRAME])
    assert [one.follows for one in frames] == [False] + 8 * [True]
    assert frames[-1].stamp_ns == pytest.approx(duration_ns(8 * FRAME), abs=100_000)
    (after,) = framing.feed(SoundBlock(stamp_ns=9, samples=sound[:FRAME], follows=False))
    assert (after.stamp_ns, after.follows) == (9, False)


def test_an_offset_of_the_microphone_is_no_sound() -> None:
    noise = 0.001 * np.random.default_rng(1).standard_normal(FRAME).astype(np.float32)
    assert level_db(noise + np.float32(0.1)) == pytest.approx(level_db(noise), abs=0.01)
    assert level_db(noise) == pytest.approx(-60.0, abs=1.0)
