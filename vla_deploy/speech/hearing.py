"""Follow the stream from frame to phrase to reading, with the robot's own voice held off."""

from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Final

from platforms import SpeechSettings
from vla_deploy.speech.companions import Playing
from vla_deploy.speech.confidence import confidence
from vla_deploy.speech.echo_gate import EchoGate
from vla_deploy.speech.frames import Frame, Framing
from vla_deploy.speech.own_words import OwnWords
from vla_deploy.speech.phrases import ABOVE_FLOOR_DB, OFFSET, Happening, Phrase, Phrases, Step
from vla_deploy.speech.reading import Reading
from vla_deploy.speech.readings import Answer, Readings
from vla_deploy.speech.sound import SoundBlock, level_db
from vla_deploy.speech.stop_watch import StopWatch
from vla_deploy.speech.surroundings import Music, NoiseFloor
from vla_deploy.speech.verdict import Case, Judgement, Verdict, judge
from vla_deploy.speech.voice_activity import VoiceActivity
from vla_deploy.speech.words import is_unfinished

Suspicion = Callable[[int, int], float]
"""How near the spotter of stop words came to hearing one from a time to another, in ns; 1 is
heard."""
STOPPED: Final = "a stop was heard in it: the robot has stopped"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Heard:
    """Hold a phrase, what was read in it, and what becomes of it."""

    phrase: Phrase
    answer: Answer | None
    confidence: float
    judgement: Judgement

    @property
    def text(self) -> str:
        """Return its words, as far as any were read."""
        reading = self.answer.reading if self.answer is not None else None
        return "" if reading is None else reading.text


@dataclass(frozen=True, slots=True)
class Room:
    """Hold what is known of where a microphone stands."""

    floor: NoiseFloor = field(default_factory=NoiseFloor)
    music: Music = field(default_factory=Music)
    gate: EchoGate = field(default_factory=EchoGate)


def unsuspected(_began_ns: int, _ended_ns: int) -> float:
    """Suspect nothing, where no spotter listens."""
    return 0.0


class Hearing:
    """Hold what hearing remembers between two blocks."""

    def __init__(
        self,
        voice_activity: VoiceActivity,
        readings: Readings,
        settings: SpeechSettings,
        hot_words: Callable[[], str],
        suspicion: Suspicion = unsuspected,
    ) -> None:
        self.readings = readings
        self.enter(Room())
        self.counts: Counter[str] = Counter()
        self._activity = voice_activity
        self._hot_words = hot_words
        self._watch = StopWatch(
            readings,
            self._confidence,
            lambda phrase: suspicion(phrase.began_ns, phrase.ended_ns),
            hot_words,
        )
        self._reads: dict[Step, Callable[[Phrase, str], None]] = {
            Step.SPEAKING: readings.glance,
            Step.PAUSED: readings.draft,
            Step.ENDED: readings.finish,
        }
        self._answered: deque[Answer] = deque()
        self._told_stop: Answer | None = None
        self._framing = Framing()
        self._phrases = Phrases(settings)
        self._own_words = OwnWords()
        self._barge_ns: int | None = None
        self._told: list[Heard] = []

    def enter(self, room: Room) -> None:
        """Listen elsewhere from the next block on; what was known of a room is kept in it."""
        self.floor, self.music, self.gate = room.floor, room.music, room.gate

    @property
    def settings(self) -> SpeechSettings:
        """Return what a phrase is, and how surely it must be understood."""
        return self._phrases.settings

    @settings.setter
    def settings(self, settings: SpeechSettings) -> None:
        self._phrases.settings = settings

    @property
    def state(self) -> str:
        """Return what hearing does at this moment."""
        if self._phrases.is_open:
            return "hearing"
        return "transcribing" if self.readings.is_busy else "listening"

    def feed(self, block: SoundBlock, playing: Playing | None) -> int | None:
        """Take the next block; return since when a person speaks into what the robot says.

        Raises:
            RunFailed: the voice network fails.
        """
        self._barge_ns = None
        for frame in self._framing.feed(block):
            self._frame(frame, playing)
        return self._barge_ns

    def heard(self) -> Iterator[Heard]:
        """Yield what has been understood, or not, since the last call."""
        self._heed_draft()
        yield from self._stop(self.readings.glanced(), is_all=False)
        yield from self._stop(self.readings.drafted(), is_all=True)
        told, self._told = self._told, []
        yield from told
        for answer in self.readings.answers():
            yield from self._stop(answer, is_all=True)
            self._answered.append(answer)
        while self._answered and not self._watch.doubts(self._answered[0].phrase):
            yield from self._end(self._answered.popleft())

    def document(self) -> dict[str, Any]:
        """Return what hearing knows of the room, as `speech_status` tells it."""
        return {
            "noise_floor_db": round(self.floor.level_db, 1),
            "music": self.music.plays,
            "echo_db": round(self.gate.coupling_db, 1),
            "counts": dict(self.counts),
        }

    def close(self) -> None:
        """Release the networks."""
        self.readings.close()
        self._activity.close()

    def _frame(self, frame: Frame, playing: Playing | None) -> None:
        if not frame.follows:
            self._activity.reset()
            self._phrases.reset()
            self.readings.forget_draft()
            self._watch.forget()
        self._watch.note(frame)
        voice, level = self._activity.probability(frame.samples), level_db(frame.samples)
        self.gate.follow(playing)
        self._own_words.follow(frame, playing)
        if self.gate.is_shut:
            voice = self._through_gate(frame, level, voice)
        else:
            self.floor.note(level, is_voice=voice >= OFFSET)
            self.music.note(frame.samples, level, voice)
        is_loud = level >= self.floor.level_db + ABOVE_FLOOR_DB
        for happening in self._phrases.feed(frame, voice, is_loud=is_loud):
            self._on(happening)

    def _through_gate(self, frame: Frame, level: float, voice: float) -> float:
        """Return how probably a person speaks while the robot does."""
        is_person = self.gate.is_person(level, voice)
        if self.gate.barges_in():
            self._barge_ns = frame.stamp_ns
            self._own_words.note_barged_in()
            self.counts["barged_in"] += 1
        return voice if is_person else 0.0

    def _on(self, happening: Happening) -> None:
        phrase = happening.phrase
        self.counts[happening.step.name.lower()] += 1
        if happening.step is Step.BEGAN:
            self._watch.forget()
            self._own_words.note_begun(is_person=not self.gate.is_shut)
        elif happening.step in self._reads:
            if happening.step is Step.ENDED:
                phrase = replace(phrase, own_words=self._own_words.within(phrase))
            self._watch.expect(phrase)
            self._reads[happening.step](phrase, self._hot_words())
        else:
            self.readings.forget_draft()
        if happening.step is Step.TOO_LONG:
            self._refuse(phrase, f"{self.settings.longest_phrase_s:g} s of talk are no command")

    def _heed_draft(self) -> None:
        """Wait longer for a speaker who pauses where the words so far cannot be all."""
        answer = self.readings.drafted() if self._phrases.is_open else None
        if answer is not None and answer.reading and is_unfinished(answer.reading.text):
            self._phrases.wait_longer()

    def _stop(self, answer: Answer | None, *, is_all: bool) -> Iterator[Heard]:
        """Stop at once by what was read while the speaker goes on, pauses or has ended."""
        self._watch.take(answer, is_all=is_all)
        for stop, sure in self._watch.stops():
            self._told_stop = stop
            judgement = Judgement(verdict=Verdict.STOP)
            yield Heard(phrase=stop.phrase, answer=stop, confidence=sure, judgement=judgement)

    def _end(self, answer: Answer) -> Iterator[Heard]:
        """Tell the whole of a phrase, unless it was told as a stop."""
        self._watch.forget()
        if not self._watch.has_stopped(answer.phrase):
            yield self._judged(answer)
        elif answer is not self._told_stop:
            yield self._after_stop(answer)

    def _after_stop(self, answer: Answer) -> Heard:
        """Tell the whole of a phrase that has stopped the robot: it is no command."""
        sure = 0.0 if answer.reading is None else self._confidence(answer.reading)
        judgement = Judgement(verdict=Verdict.REJECTED, reason=STOPPED)
        return Heard(phrase=answer.phrase, answer=answer, confidence=sure, judgement=judgement)

    def _refuse(self, phrase: Phrase, reason: str) -> None:
        judgement = Judgement(verdict=Verdict.REJECTED, reason=reason)
        self._told.append(Heard(phrase=phrase, answer=None, confidence=0.0, judgement=judgement))

    def _confidence(self, reading: Reading) -> float:
        recogniser = self.readings.recogniser
        return 0.0 if recogniser is None else confidence(reading, recogniser.declared.calibration)

    def _judged(self, answer: Answer) -> Heard:
        recogniser = self.readings.recogniser
        if answer.reading is None or recogniser is None:
            judgement = Judgement(verdict=Verdict.REJECTED, reason=answer.trouble)
            return Heard(phrase=answer.phrase, answer=answer, confidence=0.0, judgement=judgement)
        sure = self._confidence(answer.reading)
        case = Case(
            reading=answer.reading,
            phrase=answer.phrase,
            confidence=sure,
            least_confidence=self.settings.least_confidence,
            languages=recogniser.declared.languages,
            music=self.music.plays,
        )
        judgement = judge(case)
        if answer.trouble:
            judgement = Judgement(verdict=Verdict.REJECTED, reason=answer.trouble, ask_again=True)
        return Heard(phrase=answer.phrase, answer=answer, confidence=sure, judgement=judgement)
