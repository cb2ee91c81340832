"""Read phrases beside the steps: one in advance while a speaker pauses, the ended ones in order.

The rule of lateness: whoever waited longer than `LATE_NS` for an answer has gone on, and what comes
then is not carried out; of more than `MOST_WAITING` phrases that wait, the newest is refused.
"""

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.transcript import Transcript

LATE_NS: Final = 5 * NS_PER_S
MOST_WAITING: Final = 3
Reading = tuple[Phrase, Transcript | None, str]
"""What was read in a phrase that has ended, and why it is not to be carried out, if so."""


class TranscriptionQueue:
    """Hold the recogniser at work, or why there is none, and what it was asked."""

    def __init__(self, executor: Executor, clock: Clock) -> None:
        """Take an executor of one thread over, or one that works at once."""
        self.selected = SelectedRecogniser(recogniser=None, why="the recogniser is being loaded")
        self._clock = clock
        self._executor = executor
        self._draft: tuple[Phrase, Future[Transcript]] | None = None
        self._ended: list[tuple[Phrase, Future[Transcript]]] = []

    @property
    def is_busy(self) -> bool:
        """Return whether a phrase that has ended is being read."""
        return bool(self._ended)

    @property
    def recogniser(self) -> Recogniser | None:
        """Return the recogniser that reads the next phrase."""
        return self.selected.recogniser

    def draft(self, phrase: Phrase) -> None:
        """Read a phrase in advance."""
        self.forget_draft()
        if self.recogniser is not None:
            self._draft = phrase, self._ask(self.recogniser, phrase)

    def drafted(self) -> tuple[Phrase, Transcript] | None:
        """Return what was read in advance, as soon as it is there."""
        if self._draft is None:
            return None
        phrase, future = self._draft
        if not future.done() or future.exception() is not None:
            return None
        return phrase, future.result()

    def forget_draft(self) -> None:
        """Note that the speaker has gone on: what was read in advance is not all."""
        if self._draft is not None:
            self._draft[1].cancel()
        self._draft = None

    def finish(self, phrase: Phrase) -> str:
        """Take a phrase that has ended, read in advance if that was all of it; return why not."""
        draft, self._draft = self._draft, None
        if self.recogniser is None:
            return f"no model turns speech into text: {self.selected.why}"
        if len(self._ended) >= MOST_WAITING:
            return f"{MOST_WAITING} phrases are waiting to be read already"
        if draft is not None and draft[0].ended_ns == phrase.ended_ns:
            self._ended.append((phrase, draft[1]))
        else:
            self._ended.append((phrase, self._ask(self.recogniser, phrase)))
        return ""

    def answers(self) -> Iterator[Reading]:
        """Yield what has been answered since the last call, in the order of the phrases."""
        while self._ended and self._ended[0][1].done():
            phrase, future = self._ended.pop(0)
            try:
                yield phrase, future.result(), self._late(phrase)
            except RunFailed as error:
                yield phrase, None, str(error)

    def close(self) -> None:
        """Release everything; what is under way is given up."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        if self.recogniser is not None:
            self.recogniser.close()
        self.selected = SelectedRecogniser(recogniser=None, why="closed")

    def _late(self, phrase: Phrase) -> str:
        late_ns = self._clock.now_ns() - phrase.ended_ns
        return f"read {late_ns / NS_PER_S:.1f} s after it was said" if late_ns > LATE_NS else ""

    def _ask(self, recogniser: Recogniser, phrase: Phrase) -> "Future[Transcript]":
        return self._executor.submit(recogniser.read, phrase.samples)
