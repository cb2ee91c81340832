"""Phrases are read beside the steps: in advance, in order, in bounds, and never by surprise."""

from collections import deque
from concurrent.futures import Executor, Future
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.aside import AtOnce
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.reading import Reading
from vla_deploy.speech.readings import FAST_NS, MOST_WAITING, Readings


class Waiting(Executor):
    """Hold what was handed in until the test lets it be done."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future[Any], Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.waiting.append((future, lambda: fn(*args, **kwargs)))
        return future

    def work(self) -> None:
        for future, act in self.waiting:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(act())
                except RunFailed as error:
                    future.set_exception(error)
        self.waiting.clear()


class Reader:
    """Read the number of samples, in place of a network."""

    def __init__(self) -> None:
        self.read_phrases: list[int] = []
        self.earlier: list[int] = []
        self.hot_words: list[str] = []
        self.fails = False
        self.lately_ns: deque[int] = deque()
        self.closed = 0

    def read(self, samples: Any, hot_words: str, earlier: Any) -> Reading:
        if self.fails:
            raise RunFailed("ours: out of memory")
        self.read_phrases.append(len(samples))
        self.earlier.append(len(earlier))
        self.hot_words.append(hot_words)
        return Reading(
            text=f"{len(samples)} samples",
            log_probability=-0.1,
            no_speech=0.0,
            compression=1.0,
            language="en",
            duration_s=1.0,
            took_s=0.0,
        )

    def close(self) -> None:
        self.closed += 1


def phrase(number: int, ended_s: float, samples: int = 100) -> Phrase:
    return Phrase(
        number=number,
        began_ns=0,
        ended_ns=round(ended_s * NS_PER_S),
        voiced_s=1.0,
        clipped_ratio=0.0,
        voice=0.9,
        samples=np.zeros(samples, np.float32),
    )


@pytest.fixture
def pool() -> Waiting:
    return Waiting()


@pytest.fixture
def reader() -> Any:
    return Reader()


@pytest.fixture
def readings(pool: Waiting, reader: Any, clock: ManualClock) -> Readings:
    readings = Readings(pool, clock)
    readings.take(reader, "")
    return readings


def test_a_phrase_is_read_with_what_was_heard_before_it(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    readings.finish(replace(phrase(1, 0.9), earlier=np.zeros(70, np.float32)), "red cup")
    readings.glance(phrase(2, 1.9), "")
    pool.work()
    assert reader.earlier == [70]
    assert len(list(readings.answers())) == 1
    readings.glance(phrase(2, 1.9), "")
    pool.work()
    assert reader.earlier == [70, 0]


def test_what_was_read_in_advance_is_not_read_again(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    readings.draft(phrase(1, 0.9, samples=90), "red cup")
    assert readings.drafted() is None
    pool.work()
    draft = readings.drafted()
    assert draft is not None
    assert draft.reading is not None
    assert draft.reading.text == "90 samples"
    readings.finish(phrase(1, 0.9, samples=120), "red cup")
    (answer,) = readings.answers()
    assert answer.reading == draft.reading
    assert (reader.read_phrases, reader.hot_words) == ([90], ["red cup"])


def test_a_speaker_who_goes_on_is_read_again(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    readings.draft(phrase(1, 0.5, samples=50), "")
    pool.work()
    readings.forget_draft()
    assert readings.drafted() is None
    readings.finish(phrase(1, 0.9, samples=90), "")
    assert readings.is_busy
    pool.work()
    assert [answer.reading.text for answer in readings.answers() if answer.reading] == [
        "90 samples"
    ]
    assert not readings.is_busy


def test_a_glance_is_told_once_and_leaves_what_is_read_in_advance_alone(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    readings.glance(phrase(1, 0.5, samples=50), "")
    readings.glance(phrase(1, 0.6, samples=60), "")
    readings.draft(phrase(1, 0.7, samples=70), "")
    assert readings.glanced() is None
    pool.work()
    glance, draft = readings.glanced(), readings.drafted()
    assert glance is not None and glance.reading is not None
    assert draft is not None and draft.reading is not None
    assert (glance.reading.text, draft.reading.text) == ("50 samples", "70 samples")
    assert readings.glanced() is None
    assert reader.read_phrases == [50, 70]


def test_a_slow_recogniser_has_no_time_for_glances(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    reader.lately_ns.append(2 * FAST_NS)
    readings.glance(phrase(1, 0.5), "")
    assert not pool.waiting


def test_one_slow_reading_of_many_leaves_time_for_glances(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    reader.lately_ns.extend((FAST_NS, FAST_NS, 2 * FAST_NS, FAST_NS))
    readings.glance(phrase(1, 0.5), "")
    assert pool.waiting


def test_a_glance_that_fails_says_nothing(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    reader.fails = True
    readings.glance(phrase(1, 0.5), "")
    pool.work()
    assert readings.glanced() is None
    reader.fails = False
    readings.glance(phrase(1, 0.6), "")
    pool.work()
    assert readings.glanced() is not None


def test_only_one_phrase_is_read_in_advance_at_a_time(readings: Readings, pool: Waiting) -> None:
    readings.draft(phrase(1, 0.5), "")
    readings.draft(phrase(1, 0.7), "")
    assert len(pool.waiting) == 1


def test_what_is_read_too_late_of_a_pause_says_nothing_of_the_next_one(
    readings: Readings, pool: Waiting
) -> None:
    readings.draft(phrase(1, 0.5), "")
    pool.waiting[0][0].set_running_or_notify_cancel()
    readings.forget_draft()
    readings.draft(phrase(1, 0.9), "")
    assert len(pool.waiting) == 1, "the network is still at the first one"
    future, act = pool.waiting.pop()
    future.set_result(act())
    assert readings.drafted() is None
    readings.draft(phrase(1, 0.9), "")
    pool.work()
    assert readings.drafted() is not None


def test_more_phrases_than_can_wait_are_refused(readings: Readings, pool: Waiting) -> None:
    for number in range(MOST_WAITING + 1):
        readings.finish(phrase(number, 0.9), "")
    (refused,) = readings.answers()
    assert (refused.phrase.number, refused.reading) == (MOST_WAITING, None)
    assert "are waiting to be read already" in refused.trouble
    pool.work()
    assert [answer.phrase.number for answer in readings.answers()] == [0, 1, 2]


def test_what_is_read_late_says_so(readings: Readings, pool: Waiting, clock: ManualClock) -> None:
    readings.finish(phrase(1, 0.9), "")
    clock.ns = round(6.4 * NS_PER_S)
    pool.work()
    (answer,) = readings.answers()
    assert answer.trouble == "read 5.5 s after it was said"


def test_a_failing_network_is_told(readings: Readings, pool: Waiting, reader: Reader) -> None:
    reader.fails = True
    readings.draft(phrase(1, 0.9), "")
    pool.work()
    assert readings.drafted() is None
    readings.finish(phrase(1, 0.9), "")
    (answer,) = readings.answers()
    assert (answer.reading, answer.trouble) == (None, "ours: out of memory")


def test_without_a_network_each_phrase_is_refused_with_the_reason(clock: ManualClock) -> None:
    readings = Readings(AtOnce(), clock)
    readings.take(None, "commands-whisper: no such model")
    readings.draft(phrase(1, 0.9), "")
    readings.finish(phrase(1, 0.9), "")
    (answer,) = readings.answers()
    expected = "no model turns speech into text: commands-whisper: no such model"
    assert answer.trouble == expected


def test_the_network_before_is_closed_behind_what_it_was_asked(
    readings: Readings, pool: Waiting, reader: Reader
) -> None:
    readings.finish(phrase(1, 0.9), "")
    before, _ = readings.take(None, "changed")
    assert before is reader
    readings.release(before)
    assert reader.closed == 0
    pool.work()
    assert (reader.read_phrases, reader.closed) == ([100], 1)
    readings.close()
