"""Let voices of every installed engine say stop words and other things, in words not learnt from.

The phrases and the talk are the benchmark's own. Of engines that training has heard, half of the
clips are by voices that it has not, where there are such.
"""

import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from training.stop_words.cast import PARTS, CastPart, draw_style
from training.stop_words.texts import is_clean
from training.stop_words.timing import word_times
from training.voices.clip import RATE_HZ, SpokenClip, Wave
from training.voices.errors import EngineMissing, SynthesisFailed
from vla_deploy.speech.sound import NOTHING

_LAST: Final = (
    "{w}",
    "{w}",
    "{w}!",
    "hey, {w}!",
    "robot, {w}",
    "please {w}",
    "okay robot, {w}",
    "you should {w}",
)
_WITHIN: Final = (
    "{w} now",
    "{w} right there",
    "{w}, robot",
    "{w} at once please",
    "hey robot, {w} now",
    "{w} before you hit the chair",
)
_ONLY_STOP: Final = (
    "emergency stop",
    "stop moving",
    "stop the arm",
    "stop it",
    "stop that at once",
)
_WORDS: Final = ("stop", "stop", "halt", "freeze")
_NEAR: Final = (
    "he stopped at the shop",
    "the top of the step",
    "a spot on the half empty cup",
    "three fries and a frozen pizza",
    "hold the salt please",
    "she stops by on Friday",
    "the halves are in the hall",
    "freezing cold at the crossing",
    "stuff the sock into the box",
    "please fetch the chopped peas",
)
_TALKED_S: Final = 4.0
_PAUSE_S: Final = (0.3, 1.0)
_PAGES: Final = Path(__file__).resolve().parents[1] / "docs"
_CORPORA: Final = Path(__file__).resolve().parent / "corpora"
_TALK: Final = ("off_domain.txt", "overheard.txt")
_SENTENCE: Final = re.compile(r"[A-Z][a-z]+(?: [a-z]+[,;]?){3,20}[.?!]")


class Voices:
    """Know which engines are installed, and draw from their voices."""

    def __init__(self) -> None:
        """Try every engine once.

        Raises:
            EngineMissing: there is none at all.
        """
        self.missing: dict[str, str] = {}
        parts = {}
        for part in PARTS:
            try:
                part.speak("hello", _all_voices(part)[0], draw_style(np.random.default_rng(0)))
            except EngineMissing as error:
                self.missing[part.engine] = str(error)
                continue
            parts[part.engine] = part
        if not parts:
            raise EngineMissing("voices", "any engine", "libespeak-ng1")
        self._parts = parts

    @property
    def engines(self) -> tuple[str, ...]:
        """Return the names of those that are installed."""
        return tuple(self._parts)

    def tells_times(self, engine: str) -> bool:
        """Return whether words within a phrase can be timed."""
        return self._parts[engine].tells_times

    def say(self, engine: str, text: str, random: np.random.Generator) -> SpokenClip | None:
        """Let a voice say a text; None where that one cannot."""
        part = self._parts[engine]
        both = part.voices and part.held_voices
        kept = part.held_voices if both and random.random() < 0.5 else _all_voices(part)
        voice = kept[int(random.integers(len(kept)))]
        return self._spoken(part, text, voice, random)

    def before(self, clip: SpokenClip, random: np.random.Generator) -> Wave:
        """Let the voice of a clip say something else first; return the end of it and a pause."""
        texts = _overheard()
        text = texts[int(random.integers(len(texts)))]
        talk = self._spoken(self._parts[clip.engine], text, clip.voice, random)
        if talk is None:
            return NOTHING
        kept = talk.samples[-round(RATE_HZ * _TALKED_S) :]
        return np.pad(kept, (0, round(RATE_HZ * random.uniform(*_PAUSE_S))))

    def _spoken(
        self, part: CastPart, text: str, voice: str, random: np.random.Generator
    ) -> SpokenClip | None:
        try:
            return part.speak(text, voice, draw_style(random))
        except SynthesisFailed:
            return None


def phrases(
    voices: Voices, engine: str, count: int, random: np.random.Generator
) -> Iterator[tuple[SpokenClip, tuple[float, float]]]:
    """Yield phrases with one stop word, each with when it was said, in seconds."""
    for number in range(count):
        word = _WORDS[number % len(_WORDS)]
        patterns = _LAST
        if voices.tells_times(engine):
            patterns = (*_LAST, *_WITHIN, *(_ONLY_STOP if word == "stop" else ()))
        text = patterns[int(random.integers(len(patterns)))].format(w=word)
        clip = voices.say(engine, text, random)
        if clip is None:
            continue
        times = word_times(clip, word, is_last=text.rstrip("!").endswith(word))
        if times:
            yield clip, times[0]


def other_talk(voices: Voices, random: np.random.Generator) -> Iterator[SpokenClip]:
    """Yield talk of other things without a stop word, without end."""
    return _endless([*_overheard(), *_documented()], voices, random)


def words_alike(voices: Voices, random: np.random.Generator) -> Iterator[SpokenClip]:
    """Yield sentences made of words that sound like a stop word, without end."""
    return _endless(_NEAR, voices, random)


def _endless(
    texts: Sequence[str], voices: Voices, random: np.random.Generator
) -> Iterator[SpokenClip]:
    engines = voices.engines
    while True:
        text = texts[int(random.integers(len(texts)))]
        # Festival takes most of a second for a clip.
        weights = np.array([0.2 if name == "festival" else 1.0 for name in engines])
        engine = engines[int(random.choice(len(engines), p=weights / weights.sum()))]
        clip = voices.say(engine, text, random)
        if clip is not None:
            yield clip


def _all_voices(part: CastPart) -> tuple[str, ...]:
    return (*part.voices, *part.held_voices)


# A voice says one of them before each phrase.
@cache
def _overheard() -> tuple[str, ...]:
    texts = (_CORPORA / name for name in _TALK)
    lines = [line for text in texts for line in text.read_text(encoding="utf-8").splitlines()]
    return tuple(line for line in lines if line and line[0] != "#" and is_clean(line))


def _documented() -> Iterator[str]:
    """Yield the sentences of the documentation: running English on many things."""
    for page in sorted(_PAGES.glob("*.md")):
        yield from filter(is_clean, _SENTENCE.findall(page.read_text(encoding="utf-8")))
