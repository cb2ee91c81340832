"""Phrases are read beside the steps: in advance, in order, in bounds, and never by surprise."""

from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.inference.errors import RunFailed
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.transcript import Transcript
from vla_deploy.speech.transcription_queue import MOST_WAITING, TranscriptionQueue


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
        self.fails = False
        self.closed = 0

    def read(self, samples: Any) -> Transcript:
        if self.fails:
            raise RunFailed("ours: out of memory")
        self.read_phrases.append(len(samples))
        return Transcript(
            text=f"{len(samples)} samples",
            log_probability=-0.1,
            no_speech=0.0,
            compression=1.0,
            language="en",
        )

    def close(self) -> None:
        self.closed += 1


def phrase(number: int, ended_s: float, samples: int = 100) -> Phrase:
    ended_ns = round(ended_s * NS_PER_S)
    return Phrase(began_ns=number, ended_ns=ended_ns, samples=np.zeros(samples, np.float32))


@pytest.fixture
def pool() -> Waiting:
    return Waiting()


@pytest.fixture
def reader() -> Any:
    return Reader()


@pytest.fixture
def queue(pool: Waiting, reader: Any, clock: ManualClock) -> TranscriptionQueue:
    queue = TranscriptionQueue(pool, clock)
    queue.selected = SelectedRecogniser(recogniser=reader)
    return queue


def test_what_was_read_in_advance_is_not_read_again(
    queue: TranscriptionQueue, pool: Waiting, reader: Reader
) -> None:
    queue.draft(phrase(1, 0.9, samples=90))
    assert queue.drafted() is None
    pool.work()
    draft = queue.drafted()
    assert draft is not None
    assert draft[1].text == "90 samples"
    queue.finish(phrase(1, 0.9, samples=120))
    assert [transcript for _, transcript, _ in queue.answers()] == [draft[1]]
    assert reader.read_phrases == [90]


def test_a_speaker_who_goes_on_is_read_again(
    queue: TranscriptionQueue, pool: Waiting, reader: Reader
) -> None:
    queue.draft(phrase(1, 0.5, samples=50))
    pool.work()
    queue.forget_draft()
    assert queue.drafted() is None
    queue.finish(phrase(1, 0.9, samples=90))
    assert queue.is_busy
    pool.work()
    assert [transcript.text for _, transcript, _ in queue.answers() if transcript] == ["90 samples"]
    assert not queue.is_busy


def test_what_is_read_too_late_of_a_pause_says_nothing_of_the_next_one(
    queue: TranscriptionQueue, pool: Waiting, reader: Reader
) -> None:
    queue.draft(phrase(1, 0.5, samples=50))
    pool.waiting[0][0].set_running_or_notify_cancel()
    queue.draft(phrase(1, 0.9, samples=90))
    queue.draft(phrase(1, 1.2, samples=120))
    future, act = pool.waiting.pop(0)
    future.set_result(act())
    assert queue.drafted() is None, "the network was still at the first one"
    pool.work()
    draft = queue.drafted()
    assert draft is not None
    assert draft[0].ended_ns == round(1.2 * NS_PER_S)
    assert reader.read_phrases == [50, 120], "what nobody waits for any more is not read"


def test_more_phrases_than_can_wait_are_refused(queue: TranscriptionQueue, pool: Waiting) -> None:
    taken = [queue.finish(phrase(number, 0.9)) for number in range(MOST_WAITING)]
    assert taken == ["", "", ""]
    assert "are waiting to be read already" in queue.finish(phrase(MOST_WAITING, 0.9))
    pool.work()
    assert [phrase.began_ns for phrase, _, _ in queue.answers()] == [0, 1, 2]


def test_what_is_read_late_says_so(
    queue: TranscriptionQueue, pool: Waiting, clock: ManualClock
) -> None:
    queue.finish(phrase(1, 0.9))
    clock.ns = round(6.4 * NS_PER_S)
    pool.work()
    assert [trouble for _, _, trouble in queue.answers()] == ["read 5.5 s after it was said"]


def test_a_failing_network_is_told(
    queue: TranscriptionQueue, pool: Waiting, reader: Reader
) -> None:
    reader.fails = True
    queue.draft(phrase(1, 0.9))
    pool.work()
    assert queue.drafted() is None
    queue.finish(phrase(1, 0.9))
    ((_, transcript, trouble),) = queue.answers()
    assert (transcript, trouble) == (None, "ours: out of memory")


def test_without_a_network_each_phrase_is_refused_with_the_reason(clock: ManualClock) -> None:
    queue = TranscriptionQueue(InlineExecutor(), clock)
    queue.selected = SelectedRecogniser(recogniser=None, why="commands-whisper: no such model")
    queue.draft(phrase(1, 0.9))
    expected = "no model turns speech into text: commands-whisper: no such model"
    assert queue.finish(phrase(1, 0.9)) == expected
    assert list(queue.answers()) == []


def test_the_network_before_is_closed_behind_what_it_was_asked(
    queue: TranscriptionQueue, pool: Waiting, reader: Reader
) -> None:
    queue.finish(phrase(1, 0.9))
    before = queue.recogniser
    queue.selected = SelectedRecogniser(recogniser=None, why="changed")
    assert before is reader
    pool.submit(before.close)
    assert reader.closed == 0
    pool.work()
    assert (reader.read_phrases, reader.closed) == ([100], 1)
    queue.close()
