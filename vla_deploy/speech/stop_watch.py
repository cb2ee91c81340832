"""Watch for a stop in what is read while somebody speaks, pauses or has ended.

Sure words stop at once. What is only likely is read once more with the sound of the next moment,
and stops if it still is; where nothing can be read again in time, it stops as well. What hints at a
stop in a pause may become likely at the second look, and is confirmed by a third.
"""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.frames import Frame, joined
from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.reading import Reading
from vla_deploy.speech.readings import Answer, Readings
from vla_deploy.speech.stopping import Look, hints, is_confirmed, is_likely, is_sure, wants_another
from vla_deploy.speech.voice_activity import FRAME_S

LATER_FRAMES: Final = round(0.1 / FRAME_S)
"""A second look is taken with so much more sound: what only sounded like a stop mostly is none
then, and the button is still hit in half a second."""
PATIENCE_NS: Final = round(0.4 * NS_PER_S)
"""A likely stop that cannot be read again for so long is one."""
MOST_LOOKS: Final = {False: 2, True: 3}
"""By whether it may be all that is said: in a glance the next one sees more."""
_KEPT: Final = 6
"""So many glances, readings in advance and whole phrases may wait for another look at once: a
pause may be broken off and begin again."""


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
            if len(frames) < LATER_FRAMES * max(MOST_LOOKS.values()):
                frames.append(frame)

    def longer(self, phrase: Phrase, times: int) -> Phrase | None:
        """Return a phrase with so many times LATER_FRAMES after it, as soon as these are there."""
        count = times * LATER_FRAMES
        for one, frames in self._after:
            if one is phrase and len(frames) >= count:
                later = joined(frames[:count])
                return replace(phrase, samples=np.concatenate((phrase.samples, later)))
        return None


@dataclass(slots=True)
class _Watched:
    """Hold what was read and read again, and since when another look is wanted."""

    answer: Answer
    looks: list[Look]
    since_ns: int | None = None
    again: "Future[Reading] | None" = None
    is_given_up: bool = False

    @property
    def number(self) -> int:
        return self.answer.phrase.number

    @property
    def is_pending(self) -> bool:
        """Tell whether another look is to come."""
        return self.since_ns is not None


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
        self._watched = [one for one in self._watched if one.is_pending]

    def has_stopped(self, phrase: Phrase) -> bool:
        """Tell whether a stop was heard in a phrase."""
        return phrase.number in self._stopped

    def doubts(self, phrase: Phrase) -> bool:
        """Tell whether there may be a stop in a phrase, which is not decided yet."""
        return any(
            one.number == phrase.number
            and one.is_pending
            and wants_another(one.looks[-1], self._suspicion(one.answer.phrase))
            for one in self._watched
        )

    def take(self, answer: Answer | None, *, is_all: bool) -> None:
        """Watch what was read, `is_all` unless more may follow, and not what was read before it."""
        if answer is None or answer.reading is None or self.has_stopped(answer.phrase):
            return
        if any(one.looks[0].reading is answer.reading for one in self._watched):
            return
        self.forget()
        first = Look(answer.reading, self._confidence(answer.reading), is_all)
        self._watched.append(_Watched(answer, [first]))

    def stops(self) -> Iterator[tuple[Answer, float]]:
        """Yield what stops the robot by now, and by which confidence: once in a phrase."""
        for one in tuple(self._watched):
            if one.number not in self._stopped and self._is_stop(one):
                self._stopped.append(one.number)
                yield one.answer, one.looks[0].confidence
        self._watched = [one for one in self._watched if one.number not in self._stopped]

    def _is_stop(self, one: _Watched) -> bool:
        # The spotter may come to suspect a word only after it was read.
        suspicion = self._suspicion(one.answer.phrase)
        if is_sure(one.looks[0], suspicion):
            return True
        self._look_again(one, suspicion)
        while one.again is not None and one.again.done():
            self._take_again(one, one.again)
            self._look_again(one, suspicion)
        if is_sure(one.looks[-1], suspicion):
            return True
        if any(is_confirmed(first, second, suspicion) for first, second in pairwise(one.looks)):
            return True
        return one.is_given_up and is_likely(one.looks[-1], suspicion)

    def _look_again(self, one: _Watched, suspicion: float) -> None:
        """Take another look, if one is wanted, as soon as it can be; give it up where it cannot."""
        if not _is_wanted(one, suspicion):
            one.since_ns = None
            return
        now_ns = self._readings.clock.now_ns()
        one.since_ns = now_ns if one.since_ns is None else one.since_ns
        is_fast = self._readings.is_fast
        if one.again is None and is_fast:
            longer = self._aftermath.longer(one.answer.phrase, len(one.looks))
            if longer is not None:
                one.again = self._readings.read_again(longer, self._hot_words())
        if now_ns - one.since_ns > PATIENCE_NS or not is_fast:
            self._give_up(one)

    def _take_again(self, one: _Watched, again: "Future[Reading]") -> None:
        one.again = one.since_ns = None
        try:
            reading = again.result()
        except (RunFailed, CancelledError):
            self._give_up(one)
        else:
            one.looks.append(Look(reading, self._confidence(reading), one.looks[0].is_all))

    def _give_up(self, one: _Watched) -> None:
        one.is_given_up, one.since_ns = True, None


def _is_wanted(one: _Watched, suspicion: float) -> bool:
    """Tell whether another look may tell a stop; in a pause a hint of one asks for a second."""
    last = one.looks[-1]
    if one.is_given_up or len(one.looks) == MOST_LOOKS[last.is_all]:
        return False
    is_hint = last.is_all and len(one.looks) == 1 and hints(last)
    return is_hint or wants_another(last, suspicion)
