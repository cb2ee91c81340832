"""What may be a stop is read once more with a moment more of sound, and stops if it still is."""

from collections import deque
from typing import Any, cast

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.aside import AtOnce
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.frames import Frame
from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.reading import Reading
from vla_deploy.speech.readings import FAST_NS, Answer, Readings
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.sound import duration_ns
from vla_deploy.speech.stop_watch import LATER_FRAMES, PATIENCE_NS, StopWatch
from vla_deploy.speech.voice_activity import FRAME

SURE, UNSURE = 0.9, 0.3
SUSPICION = 0.5


def reading(text: str, confidence: float = UNSURE, surety: float | None = None) -> Reading:
    """Return a reading whose log-probability is its confidence, for the watch under test."""
    return Reading(
        text=text,
        log_probability=confidence,
        no_speech=0.0,
        compression=1.0,
        language="en",
        duration_s=1.0,
        took_s=0.0,
        stop_surety=surety,
    )


def phrase(number: int = 1) -> Phrase:
    return Phrase(
        number=number,
        began_ns=0,
        ended_ns=NS_PER_S,
        voiced_s=1.0,
        clipped_ratio=0.0,
        voice=0.9,
        samples=np.zeros(4 * FRAME, np.float32),
    )


class Reader:
    """Read what the test says, the last of it ever again, in place of a network."""

    def __init__(self, *again: Reading) -> None:
        self.lately_ns: deque[int] = deque()
        self.lengths: list[int] = []
        self.fails = False
        self._again = again

    def read(self, samples: Any, _hot_words: str, _earlier: Any) -> Reading:
        self.lengths.append(len(samples))
        if self.fails:
            raise RunFailed("ours: out of memory")
        return self._again[min(len(self.lengths), len(self._again)) - 1]


class Rig:
    """Run a watch on frames that come one by one."""

    def __init__(self, clock: ManualClock, *again: Reading) -> None:
        self.reader = Reader(*again)
        self.suspicion = 0.0
        self._clock = clock
        self._readings = Readings(AtOnce(), clock)
        self._readings.take(cast("Recogniser", self.reader), "")
        self._frames = 0
        self.watch = StopWatch(
            self._readings, lambda one: one.log_probability, lambda _: self.suspicion, lambda: ""
        )

    def read(self, text: str, number: int = 1, *, is_all: bool = True, **told: Any) -> Phrase:
        """Take a phrase that was read as that text."""
        one = phrase(number)
        self.watch.expect(one)
        self.watch.take(Answer(phrase=one, reading=reading(text, **told)), is_all=is_all)
        return one

    def frames(self, count: int = LATER_FRAMES, *, follows: bool = True) -> None:
        """Hear so many frames more."""
        for number in range(count):
            stamp_ns = duration_ns(self._frames * FRAME)
            self._frames += 1
            self._clock.sleep_until(self._clock.now_ns() + duration_ns(FRAME))
            samples = np.ones(FRAME, np.float32)
            frame = Frame(stamp_ns=stamp_ns, samples=samples, follows=follows or number > 0)
            self.watch.note(frame)

    def stops(self) -> list[str]:
        """Return the texts by which the robot is stopped now."""
        return [one.reading.text for one, _ in self.watch.stops() if one.reading is not None]


@pytest.fixture
def rig(clock: ManualClock) -> Rig:
    return Rig(clock, reading("halt now"))


def test_sure_words_stop_at_once_and_once(rig: Rig) -> None:
    one = rig.read("stop the arm", confidence=SURE)
    assert rig.stops() == ["stop the arm"]
    assert rig.stops() == []
    assert rig.watch.has_stopped(one)
    rig.read("stop the arm now", confidence=SURE)
    assert rig.stops() == [], "of the same phrase"
    assert rig.reader.lengths == []


def test_likely_words_stop_if_they_still_are_with_the_next_moment(rig: Rig) -> None:
    one = rig.read("halt")
    assert rig.stops() == []
    assert rig.watch.doubts(one)
    rig.frames(LATER_FRAMES - 1)
    assert rig.stops() == []
    rig.frames(1)
    assert rig.stops() == ["halt"]
    assert rig.reader.lengths == [(4 + LATER_FRAMES) * FRAME]


def test_words_that_turn_out_to_be_others_stop_nothing(clock: ManualClock) -> None:
    rig = Rig(clock, reading("hold your horses"))
    one = rig.read("halt")
    assert rig.stops() == []
    rig.frames()
    assert rig.stops() == []
    assert not rig.watch.doubts(one)
    rig.frames(30)
    assert rig.stops() == [], "not later either"
    assert len(rig.reader.lengths) == 1


def test_a_hint_in_a_pause_becomes_likely_at_the_second_look_and_is_confirmed_by_a_third(
    clock: ManualClock,
) -> None:
    rig = Rig(clock, reading("halt", surety=0.3))
    one = rig.read("hold", surety=0.1)
    assert rig.stops() == []
    assert not rig.watch.doubts(one), "it may be told as what it was read as"
    rig.watch.forget()
    rig.frames()
    assert rig.stops() == []
    assert rig.watch.doubts(one)
    rig.frames(LATER_FRAMES - 1)
    assert rig.stops() == []
    rig.frames(1)
    assert rig.stops() == ["hold"]
    assert rig.reader.lengths == [(4 + times * LATER_FRAMES) * FRAME for times in (1, 2)]


@pytest.mark.parametrize("surety", [0.01, 0.1])
def test_neither_nothing_nor_a_hint_that_fades_stops(clock: ManualClock, surety: float) -> None:
    rig = Rig(clock, reading("hold", surety=0.02))
    rig.read("hold", surety=surety)
    for _ in range(4):
        assert rig.stops() == []
        rig.frames()
    assert len(rig.reader.lengths) == (surety > 0.05)


def test_words_that_are_sure_at_the_second_look_stop(clock: ManualClock) -> None:
    rig = Rig(clock, reading("the stop", confidence=SURE, surety=0.1))
    rig.read("the store", surety=0.1)
    rig.stops()
    rig.frames()
    assert rig.stops() == ["the store"]


def test_while_somebody_goes_on_the_next_glance_sees_more_than_a_third_look(
    clock: ManualClock,
) -> None:
    rig = Rig(clock, reading("halt the arm", surety=0.3))
    rig.suspicion = SUSPICION
    rig.read("halt the", is_all=False, confidence=0.5, surety=0.3)
    for _ in range(4):
        assert rig.stops() == []
        rig.frames()
    assert len(rig.reader.lengths) == 1


def test_a_suspicion_that_comes_late_still_makes_words_likely(rig: Rig) -> None:
    rig.read("halt the arm", confidence=0.5)
    assert rig.stops() == []
    rig.frames()
    assert rig.stops() == []
    assert rig.reader.lengths == []
    rig.suspicion = SUSPICION
    assert rig.stops() == ["halt the arm"], "what it is read again with has been heard by now"
    assert rig.reader.lengths == [(4 + LATER_FRAMES) * FRAME]


def test_what_is_said_meanwhile_takes_no_doubt_away(rig: Rig) -> None:
    one = rig.read("halt")
    rig.stops()
    rig.watch.forget()
    rig.read("take the cup", number=2)
    rig.frames()
    assert rig.stops() == ["halt"]
    assert rig.watch.has_stopped(one)


def test_a_stop_in_the_next_phrase_ends_neither(rig: Rig) -> None:
    doubted = rig.read("halt")
    rig.stops()
    sure = rig.read("stop the arm", number=2, confidence=SURE)
    assert rig.stops() == ["stop the arm"]
    rig.frames()
    assert rig.stops() == ["halt"]
    assert rig.watch.has_stopped(doubted)
    assert rig.watch.has_stopped(sure)


def test_what_is_no_doubt_is_forgotten(rig: Rig) -> None:
    rig.read("halt the arm", confidence=0.5)
    rig.stops()
    rig.watch.forget()
    rig.suspicion = SUSPICION
    rig.frames()
    assert rig.stops() == []


@pytest.mark.parametrize("frames", [0, LATER_FRAMES], ids=["no more sound", "after a gap"])
def test_where_no_more_sound_follows_a_likely_stop_is_one(
    rig: Rig, clock: ManualClock, frames: int
) -> None:
    one = rig.read("halt")
    assert rig.stops() == []
    rig.frames(frames, follows=False)
    assert rig.stops() == []
    clock.sleep_until(clock.now_ns() + PATIENCE_NS + 1)
    assert rig.stops() == ["halt"]
    assert rig.reader.lengths == []
    assert not rig.watch.doubts(one)


def test_a_recogniser_that_fails_leaves_a_likely_stop_one(rig: Rig) -> None:
    rig.reader.fails = True
    rig.read("halt")
    rig.stops()
    rig.frames()
    assert rig.stops() == ["halt"]


def test_a_slow_recogniser_is_not_asked_again(rig: Rig) -> None:
    rig.reader.lately_ns.append(2 * FAST_NS)
    rig.read("halt")
    assert rig.stops() == ["halt"]
    assert rig.reader.lengths == []


def test_nothing_read_stops_nothing(rig: Rig) -> None:
    rig.watch.take(None, is_all=True)
    rig.watch.take(Answer(phrase=phrase(), reading=None, trouble="out of memory"), is_all=True)
    assert rig.stops() == []
