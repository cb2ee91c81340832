"""Read phrases beside the steps: one in advance while a speaker pauses, the ended ones in order.

The rule of lateness: whoever waited longer than `LATE_NS` for an answer has gone on, and what comes
then is not carried out; of more than `MOST_WAITING` phrases that wait, the newest is refused.
"""

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.inference.errors import RunFailed
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.model_selection import SelectedRecogniser
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.transcript import Transcript

LATE_NS: Final = 5 * NS_PER_S
MOST_WAITING: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhraseTranscript:
    """Hold what was read in a phrase, or in one so far; None, and why, where nothing could be."""

    phrase: Phrase
    transcript: Transcript | None
    trouble: str = ""


class TranscriptionQueue:
    """Hold the recogniser at work, or why there is none, and what it was asked."""

    def __init__(self, executor: Executor, clock: Clock) -> None:
        """Take an executor of one thread over, or one that works at once."""
        self.selected = SelectedRecogniser(recogniser=None, why="the recogniser is being loaded")
        self._clock = clock
        self._executor = executor
        self._draft: tuple[Phrase, Future[Transcript]] | None = None
        self._drafting: Future[Transcript] | None = None
        self._ended: list[tuple[Phrase, Future[Transcript]]] = []
        self._refused: list[PhraseTranscript] = []

    @property
    def is_busy(self) -> bool:
        """Return whether a phrase that has ended is being read."""
        return bool(self._ended)

    @property
    def recogniser(self) -> Recogniser | None:
        """Return the recogniser that reads the next phrase."""
        return self.selected.recogniser

    def draft(self, phrase: Phrase) -> None:
        """Read a phrase in advance, unless something is being read."""
        under_way = self._drafting is not None and not self._drafting.done()
        if self.recogniser is not None and not under_way and not self._ended:
            self._drafting = self._ask(self.recogniser, phrase)
            self._draft = phrase, self._drafting

    def drafted(self) -> PhraseTranscript | None:
        """Return what was read in advance, as soon as it is there."""
        if self._draft is None:
            return None
        phrase, future = self._draft
        if not future.done() or future.cancelled() or future.exception() is not None:
            return None
        return PhraseTranscript(phrase=phrase, transcript=future.result())

    def forget_draft(self) -> None:
        """Note that the speaker has gone on: what was read in advance is not all."""
        draft, self._draft = self._draft, None
        if draft is not None:
            draft[1].cancel()

    def finish(self, phrase: Phrase) -> None:
        """Take a phrase that has ended: by what was read in advance, if that was all of it."""
        draft, self._draft = self._draft, None
        if self.recogniser is None:
            self._refuse(phrase, f"no model turns speech into text: {self.selected.why}")
        elif len(self._ended) >= MOST_WAITING:
            self._refuse(phrase, f"{MOST_WAITING} phrases are waiting to be read already")
        elif draft is not None and draft[0].ended_ns == phrase.ended_ns:
            self._ended.append((phrase, draft[1]))
        else:
            self._ended.append((phrase, self._ask(self.recogniser, phrase)))

    def answers(self) -> Iterator[PhraseTranscript]:
        """Yield what has been answered since the last call, in the order of the phrases."""
        refused, self._refused = self._refused, []
        yield from refused
        while self._ended and self._ended[0][1].done():
            phrase, future = self._ended.pop(0)
            try:
                transcript, trouble = future.result(), self._late(phrase)
            except RunFailed as error:
                transcript, trouble = None, str(error)
            yield PhraseTranscript(phrase=phrase, transcript=transcript, trouble=trouble)

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

    def _refuse(self, phrase: Phrase, trouble: str) -> None:
        self._refused.append(PhraseTranscript(phrase=phrase, transcript=None, trouble=trouble))
