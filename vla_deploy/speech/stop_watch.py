"""Watch for a stop in what is read while somebody speaks, pauses or has ended.

Sure words stop at once. What is only likely is read once more with the sound of the next moment,
and stops if it still is; where nothing can be read again in time, it stops as well.
"""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.frames import Frame
from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.readings import Answer, Readings
from vla_deploy.speech.recogniser import Reading
from vla_deploy.speech.stopping import Look, is_confirmed, is_likely, is_sure, wants_second
from vla_deploy.speech.voice_activity import FRAME_S

LATER_FRAMES: Final = round(0.16 / FRAME_S)
"""A second look is taken with so much more sound: what only sounded like a stop mostly is none
then, and the button is still hit in half a second."""
PATIENCE_NS: Final = round(0.4 * NS_PER_S)
"""A likely stop that cannot be read again for so long is one."""
_KEPT: Final = 3
"""A glance, what is read in advance and the whole phrase may wait for a second look at once."""


class Aftermath:
    """Hold what was heard just after phrases."""

    def __init__(self) -> None:
        self._after: deque[tuple[Phrase, list[Frame]]] = deque(maxlen=_KEPT)

    def expect(self, phrase: Phrase) -> None:
        """Keep what is heard from now on along with a phrase that ends now."""
        self._after.append((phrase, []))

    def note(self, frame: Frame) -> None:
        """Take the next frame; where something is missing before it, nothing is expected."""
        if not frame.follows:
            self._after.clear()
        for _, frames in self._after:
            if len(frames) < LATER_FRAMES:
                frames.append(frame)

    def longer(self, phrase: Phrase) -> Phrase | None:
        """Return a phrase with what was heard after it, as soon as that is enough."""
        for one, frames in self._after:
            if one is phrase and len(frames) == LATER_FRAMES:
                sound = np.concatenate([phrase.samples, *(frame.samples for frame in frames)])
                return replace(phrase, samples=sound)
        return None


@dataclass(slots=True)
class _Watched:
    """Hold what was read first, since when it may be a stop, and the second look at it."""

    answer: Answer
    first: Look
    since_ns: int | None = None
    again: "Future[Reading] | None" = None
    is_settled: bool = False

    @property
    def number(self) -> int:
        return self.answer.phrase.number

    @property
    def is_doubt(self) -> bool:
        """Tell whether a second look at it is to come."""
        return self.since_ns is not None and not self.is_settled


class StopWatch:
    """Hold what was read last, and what is to be looked at again."""

    def __init__(
        self,
        readings: Readings,
        confidence: Callable[[Reading], float],
        suspicion: Callable[[Phrase], float],
        hot_words: Callable[[], str],
    ) -> None:
        self._readings = readings
        self._confidence = confidence
        self._suspicion = suspicion
        self._hot_words = hot_words
        self._aftermath = Aftermath()
        self._watched: list[_Watched] = []
        self._stopped: deque[int] = deque(maxlen=_KEPT)

    def note(self, frame: Frame) -> None:
        """Take the next frame of the stream."""
        self._aftermath.note(frame)

    def expect(self, phrase: Phrase) -> None:
        """Remember that a phrase, or one so far, is being read."""
        self._aftermath.expect(phrase)

    def forget(self) -> None:
        """Say that what was read last is over; what may be a stop is still looked at again."""
        self._watched = [one for one in self._watched if one.is_doubt]

    def has_stopped(self, phrase: Phrase) -> bool:
        """Tell whether a stop was heard in a phrase."""
        return phrase.number in self._stopped

    def doubts(self, phrase: Phrase) -> bool:
        """Tell whether there may be a stop in a phrase, which is not decided yet."""
        return any(one.is_doubt and one.number == phrase.number for one in self._watched)

    def take(self, answer: Answer | None, *, is_all: bool) -> None:
        """Watch what was read, `is_all` unless more may follow, and not what was read before it."""
        if answer is None or answer.reading is None or self.has_stopped(answer.phrase):
            return
        if any(one.first.reading is answer.reading for one in self._watched):
            return
        self.forget()
        first = Look(answer.reading, self._confidence(answer.reading), is_all)
        self._watched.append(_Watched(answer, first))

    def stops(self) -> Iterator[tuple[Answer, float]]:
        """Yield what stops the robot by now, and by which confidence: once in a phrase."""
        for one in tuple(self._watched):
            if one.number not in self._stopped and self._is_stop(one):
                self._stopped.append(one.number)
                yield one.answer, one.first.confidence
        self._watched = [one for one in self._watched if one.number not in self._stopped]

    def _is_stop(self, one: _Watched) -> bool:
        # The spotter may come to suspect a word only after it was read.
        suspicion = self._suspicion(one.answer.phrase)
        if is_sure(one.first, suspicion):
            return True
        if one.since_ns is None and wants_second(one.first, suspicion):
            one.since_ns = self._readings.clock.now_ns()
        return one.since_ns is not None and self._is_stop_still(one, one.since_ns, suspicion)

    def _is_stop_still(self, one: _Watched, since_ns: int, suspicion: float) -> bool:
        """Tell it by a second look; where none is to be had, what was likely at first is one."""
        if one.again is None and self._readings.is_fast:
            longer = self._aftermath.longer(one.answer.phrase)
            if longer is not None:
                one.again = self._readings.read_again(longer, self._hot_words())
        if one.again is not None and one.again.done():
            one.is_settled = True
            second = self._second(one.again, is_all=one.first.is_all)
            if second is not None:
                return is_confirmed(one.first, second, suspicion)
        is_late = self._readings.clock.now_ns() - since_ns > PATIENCE_NS
        one.is_settled = one.is_settled or is_late or not self._readings.is_fast
        return one.is_settled and is_likely(one.first, suspicion)

    def _second(self, again: "Future[Reading]", *, is_all: bool) -> Look | None:
        """Return what was read again, None where the recogniser failed."""
        try:
            reading = again.result()
        except (RunFailed, CancelledError):
            return None
        return Look(reading, self._confidence(reading), is_all)
