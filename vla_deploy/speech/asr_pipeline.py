"""Follow the stream from frame to phrase to transcript, with the robot's own voice held off."""

from collections.abc import Iterator, Set
from dataclasses import dataclass, replace
from typing import Final, Literal

from platforms import SpeechSettings
from vla_deploy.speech.echo_gate import EchoGate
from vla_deploy.speech.endpointing import Endpointer, Phrase, VadEventKind
from vla_deploy.speech.sound import Playing, SoundBlock
from vla_deploy.speech.transcript import Transcript
from vla_deploy.speech.transcription_queue import TranscriptionQueue
from vla_deploy.speech.verdict import PhraseJudgement, PhraseVerdict, judge, stops
from vla_deploy.speech.voice_activity import VoiceActivity
from vla_deploy.speech.words import is_unfinished

STOPPED: Final = "a stop was heard in it: the robot has stopped"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HeardPhrase:
    """Hold a phrase, what was read in it, and what becomes of it."""

    phrase: Phrase
    transcript: Transcript | None
    judgement: PhraseJudgement

    @property
    def confidence(self) -> float:
        """Return how probably its words are right."""
        return 0.0 if self.transcript is None else self.transcript.confidence

    @property
    def text(self) -> str:
        """Return its words, as far as any were read."""
        return "" if self.transcript is None else self.transcript.text


class AsrPipeline:
    """Hold what hearing remembers between two frames."""

    def __init__(
        self,
        voice_activity: VoiceActivity,
        queue: TranscriptionQueue,
        settings: SpeechSettings,
        names: Set[str] = frozenset(),
    ) -> None:
        """Take the networks over; `names` are those that the robot answers to."""
        self.queue = queue
        self.endpointer = Endpointer(settings)
        self._activity = voice_activity
        self._names = names
        self._gate = EchoGate()
        self._stopped_ns: int | None = None
        self._refused: list[HeardPhrase] = []

    @property
    def state(self) -> Literal["hearing", "transcribing", "listening"]:
        """Return what hearing does at this moment."""
        if self.endpointer.is_open:
            return "hearing"
        return "transcribing" if self.queue.is_busy else "listening"

    def feed(self, frame: SoundBlock, playing: Playing | None) -> bool:
        """Take the next frame; return whether a person begins to speak into what the robot says.

        Raises:
            RunFailed: the voice network fails.
        """
        before = self._gate.barged_in
        if not frame.follows:
            self._activity.reset()
            self.endpointer.reset()
            self.queue.forget_draft()
        voice = self._activity.probability(frame.samples)
        voice = self._gate.persons_voice(frame, voice, playing)
        for kind, phrase in self.endpointer.feed(frame, voice):
            self._on(kind, replace(phrase, own_words=self._gate.own_words(phrase)))
        return self._gate.barged_in and not before

    def heard(self) -> Iterator[HeardPhrase]:
        """Yield what has been understood, or not, since the last call: a stop even in a pause."""
        draft = self.queue.drafted()
        if draft is not None:
            yield from self._draft(*draft)
        refused, self._refused = self._refused, []
        yield from refused
        for reading in self.queue.answers():
            yield self._judged(*reading)

    def close(self) -> None:
        """Release the networks."""
        self.queue.close()
        self._activity.close()

    def _on(self, kind: VadEventKind, phrase: Phrase) -> None:
        refusal = ""
        match kind:
            case VadEventKind.PAUSED:
                self.queue.draft(phrase)
            case VadEventKind.RESUMED | VadEventKind.TOO_SHORT:
                self.queue.forget_draft()
            case VadEventKind.ENDED:
                refusal = self.queue.finish(phrase)
            case VadEventKind.TOO_LONG:
                self.queue.forget_draft()
                longest_s = self.endpointer.settings.longest_phrase_s
                refusal = f"{longest_s:g} s of talk are no command"
        if refusal:
            self._refused.append(self._judged(phrase, None, refusal))

    def _draft(self, phrase: Phrase, transcript: Transcript) -> Iterator[HeardPhrase]:
        """Stop at once by the words so far; wait longer where they cannot be all."""
        if phrase.began_ns == self._stopped_ns:
            return
        if self._stops(phrase, transcript):
            self._stopped_ns = phrase.began_ns
            stop = PhraseJudgement(verdict=PhraseVerdict.STOP)
            yield HeardPhrase(phrase=phrase, transcript=transcript, judgement=stop)
        elif self.endpointer.is_open and is_unfinished(transcript.text):
            self.endpointer.wait_longer()

    def _judged(self, phrase: Phrase, transcript: Transcript | None, trouble: str) -> HeardPhrase:
        """Return what becomes of a phrase that has ended."""
        if transcript is None:
            judgement = PhraseJudgement(verdict=PhraseVerdict.REJECTED, reason=trouble)
        elif phrase.began_ns == self._stopped_ns:
            judgement = PhraseJudgement(verdict=PhraseVerdict.REJECTED, reason=STOPPED)
        elif self._stops(phrase, transcript):
            judgement = PhraseJudgement(verdict=PhraseVerdict.STOP)
        elif trouble:
            judgement = PhraseJudgement(
                verdict=PhraseVerdict.REJECTED, reason=trouble, ask_again=True
            )
        else:
            least = self.endpointer.settings.least_confidence
            judgement = judge(transcript, phrase.own_words, least)
        return HeardPhrase(phrase=phrase, transcript=transcript, judgement=judgement)

    def _stops(self, phrase: Phrase, transcript: Transcript) -> bool:
        return stops(transcript.text, transcript.confidence, phrase.own_words, self._names)
