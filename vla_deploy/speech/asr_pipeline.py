"""Follow the stream from frame to phrase to transcript, with the robot's own voice held off."""

from collections import Counter
from collections.abc import Iterator, Set
from dataclasses import dataclass, replace
from typing import Any, Final

from platforms import SpeechSettings
from vla_deploy.speech.echo_gate import EchoGate
from vla_deploy.speech.endpointing import Endpointer, Phrase, VadEvent, VadEventKind
from vla_deploy.speech.sound import Framer, Playing, SoundBlock, level_db
from vla_deploy.speech.transcript import Transcript, confidence
from vla_deploy.speech.transcription_queue import PhraseTranscript, TranscriptionQueue
from vla_deploy.speech.verdict import Case, Judgement, Verdict, judge, stops
from vla_deploy.speech.voice_activity import VoiceActivity
from vla_deploy.speech.words import is_unfinished

STOPPED: Final = "a stop was heard in it: the robot has stopped"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeardPhrase:
    """Hold a phrase, what was read in it, and what becomes of it."""

    phrase: Phrase
    transcript: Transcript | None
    confidence: float
    judgement: Judgement

    @property
    def text(self) -> str:
        """Return its words, as far as any were read."""
        return "" if self.transcript is None else self.transcript.text


class AsrPipeline:
    """Hold what hearing remembers between two blocks."""

    def __init__(
        self,
        voice_activity: VoiceActivity,
        queue: TranscriptionQueue,
        settings: SpeechSettings,
        names: Set[str] = frozenset(),
    ) -> None:
        """Take the networks over; `names` are those that the robot answers to."""
        self.queue = queue
        self.counts: Counter[str] = Counter()
        self._activity = voice_activity
        self._names = names
        self._framer = Framer()
        self._gate = EchoGate()
        self.endpointer = Endpointer(settings)
        self._stopped_number = 0
        self._barged_in = False
        self._refused: list[HeardPhrase] = []

    @property
    def state(self) -> str:
        """Return what hearing does at this moment."""
        if self.endpointer.is_open:
            return "hearing"
        return "transcribing" if self.queue.is_busy else "listening"

    def feed(self, block: SoundBlock, playing: Playing | None) -> bool:
        """Take the next block; return whether a person begins to speak into what the robot says.

        Raises:
            RunFailed: the voice network fails.
        """
        self._barged_in = False
        for frame in self._framer.feed(block):
            self._frame(frame, playing)
        return self._barged_in

    def heard(self) -> Iterator[HeardPhrase]:
        """Yield what has been understood, or not, since the last call: a stop even in a pause."""
        draft = self.queue.drafted()
        if draft is not None:
            yield from self._draft(draft)
        refused, self._refused = self._refused, []
        yield from refused
        for answer in self.queue.answers():
            yield self._judged(answer)

    def document(self) -> dict[str, Any]:
        """Return how many phrases have begun, ended and so on, as `speech_status` tells it."""
        return {"counts": dict(self.counts)}

    def close(self) -> None:
        """Release the networks."""
        self.queue.close()
        self._activity.close()

    def _frame(self, frame: SoundBlock, playing: Playing | None) -> None:
        if not frame.follows:
            self._activity.reset()
            self.endpointer.reset()
            self.queue.forget_draft()
        voice = self._activity.probability(frame.samples)
        self._gate.follow(playing, frame.end_ns)
        if self._gate.is_shut:
            voice = self._through_gate(frame, voice)
        for event in self.endpointer.feed(frame, voice):
            self._on(event)

    def _through_gate(self, frame: SoundBlock, voice: float) -> float:
        """Return how probably a person speaks while the robot does."""
        is_person = self._gate.is_person(level_db(frame.samples), voice)
        if self._gate.barges_in():
            self._barged_in = True
        return voice if is_person else 0.0

    def _on(self, event: VadEvent) -> None:
        kind = event.kind
        phrase = replace(event.phrase, own_words=self._gate.own_words(event.phrase))
        self.counts[kind.name.lower()] += 1
        if kind is VadEventKind.BEGAN:
            self._gate.note_begun()
        elif kind is VadEventKind.PAUSED:
            self.queue.draft(phrase)
        elif kind is VadEventKind.ENDED:
            self.queue.finish(phrase)
        else:
            self.queue.forget_draft()
        if kind is VadEventKind.TOO_LONG:
            reason = f"{self.endpointer.settings.longest_phrase_s:g} s of talk are no command"
            self._refused.append(_refused(phrase, reason))

    def _draft(self, draft: PhraseTranscript) -> Iterator[HeardPhrase]:
        """Stop at once by the words so far; wait longer where they cannot be all."""
        if draft.transcript is None or draft.phrase.number == self._stopped_number:
            return
        sure = self._confidence(draft.transcript)
        if self._stops(draft.phrase, draft.transcript, sure):
            self._stopped_number = draft.phrase.number
            yield _heard(draft, sure, Judgement(verdict=Verdict.STOP))
        elif self.endpointer.is_open and is_unfinished(draft.transcript.text):
            self.endpointer.wait_longer()

    def _judged(self, answer: PhraseTranscript) -> HeardPhrase:
        """Return what becomes of a phrase that has ended."""
        recogniser = self.queue.recogniser
        if answer.transcript is None or recogniser is None:
            return _refused(answer.phrase, answer.trouble)
        sure = self._confidence(answer.transcript)
        if answer.phrase.number == self._stopped_number:
            judgement = Judgement(verdict=Verdict.REJECTED, reason=STOPPED)
        elif self._stops(answer.phrase, answer.transcript, sure):
            judgement = Judgement(verdict=Verdict.STOP)
        elif answer.trouble:
            judgement = Judgement(verdict=Verdict.REJECTED, reason=answer.trouble, ask_again=True)
        else:
            case = Case(
                transcript=answer.transcript,
                phrase=answer.phrase,
                confidence=sure,
                least_confidence=self.endpointer.settings.least_confidence,
                languages=recogniser.declared.languages,
            )
            judgement = judge(case)
        return _heard(answer, sure, judgement)

    def _stops(self, phrase: Phrase, transcript: Transcript, sure: float) -> bool:
        return stops(transcript.text, sure, phrase.own_words, self._names)

    def _confidence(self, transcript: Transcript) -> float:
        recogniser = self.queue.recogniser
        return (
            0.0 if recogniser is None else confidence(transcript, recogniser.declared.calibration)
        )


def _heard(answer: PhraseTranscript, sure: float, judgement: Judgement) -> HeardPhrase:
    return HeardPhrase(
        phrase=answer.phrase, transcript=answer.transcript, confidence=sure, judgement=judgement
    )


def _refused(phrase: Phrase, reason: str) -> HeardPhrase:
    judgement = Judgement(verdict=Verdict.REJECTED, reason=reason)
    return HeardPhrase(phrase=phrase, transcript=None, confidence=0.0, judgement=judgement)
