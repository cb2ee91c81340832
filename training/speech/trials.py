"""Speak what a recogniser is judged by: held-out sentences and voices, noise, other talk."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from training.speech.clips.sentences import HELD_OUT, draw_sentence
from training.voices import espeak, festival, kokoro
from training.voices.cast import (
    Speaker,
    draw_held_out,
    draw_speaker,
    draw_style,
    say,
)
from training.voices.clip import RATE_HZ, SpokenClip
from training.voices.mixing import at_level, at_snr
from training.voices.noises import KINDS, noise

Random = np.random.Generator
_SPEECH_LEVEL_DB: Final = -23.0
_LEAD_S, _TAIL_S = 0.3, 0.3
FOREIGN: Final = ("de", "fr", "es", "it", "pl", "nl", "sv", "pt", "tr", "fi", "ru", "cs")
_FOREIGN_TALK: Final = "la casa e il mondo sono grandi und der kleine hund schläft hier pour nous"


def sentences(name: str) -> list[str]:
    """Return held-out sentences: of `commands`, or of other `talk`."""
    lines = (HELD_OUT / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def by_held_out_voices(texts: Sequence[str], random: Random) -> list[SpokenClip]:
    """Speak texts by eSpeak's voices that training never heard."""
    return [say(text, draw_held_out(random), draw_style(random)) for text in texts]


def by_known_voices(texts: Sequence[str], random: Random, flite_share: float) -> list[SpokenClip]:
    """Speak texts by voices of training; a share of one speaks flite alone."""
    return [say(text, draw_speaker(random, flite_share), draw_style(random)) for text in texts]


def by_unseen_engine(texts: Sequence[str], random: Random) -> list[SpokenClip]:
    """Speak texts by festival's voices in turn; training never heard that engine.

    Raises:
        EngineMissing: festival or one of its voices is not installed.
    """
    voices = list(festival.VOICES)
    return festival.speak_all(
        [
            (text, voices[number % len(voices)], draw_style(random))
            for number, text in enumerate(texts)
        ]
    )


def by_styles(texts: Sequence[str], random: Random, styles: Sequence[str]) -> list[SpokenClip]:
    """Speak every third text by styles of Kokoro in turn: a clip takes it as long as it lasts.

    Raises:
        EngineMissing: a package, the folder of styles or eSpeak NG is not installed.
    """
    return [
        kokoro.speak(text, styles[number % len(styles)], draw_style(random))
        for number, text in enumerate(texts[::3])
    ]


def by_foreigners(count: int, random: Random) -> list[SpokenClip]:
    """Speak in other languages, to see that no command is heard in them."""
    words = _FOREIGN_TALK.split()
    clips = []
    for number in range(count):
        text = " ".join(str(word) for word in random.permutation(words)[:6])
        voice = Speaker(engine=espeak.ENGINE, voice=FOREIGN[number % len(FOREIGN)])
        clips.append(say(text, voice, draw_style(random)))
    return clips


def heard(clip: SpokenClip, random: Random, snr_db: float | None = None) -> SpokenClip:
    """Return a clip as a microphone takes it: silence around it, a level, noise at a ratio."""
    padding = (int(_LEAD_S * RATE_HZ), int(_TAIL_S * RATE_HZ))
    wave = np.pad(clip.samples, padding)
    if snr_db is not None:
        kind = list(KINDS)[int(random.integers(len(KINDS)))]
        wave = at_snr(wave, noise(kind, len(wave), random), snr_db)
    floor = random.standard_normal(len(wave)).astype(np.float32) * np.float32(1e-4)
    return replace(clip, samples=at_level(wave, _SPEECH_LEVEL_DB) + floor, sounds=())


def noises_alone(count: int, random: Random) -> list[SpokenClip]:
    """Return noise of each kind in turn, two seconds each."""
    kinds = list(KINDS)
    return [
        SpokenClip(
            text="",
            engine="noise",
            voice=kinds[number % len(kinds)],
            samples=noise(kinds[number % len(kinds)], 2 * RATE_HZ, random) * np.float32(0.03),
        )
        for number in range(count)
    ]


def drawn_sentences(count: int, random: Random) -> list[str]:
    """Return sentences as training draws them, of at least three words."""
    drawn = (draw_sentence(random) for _ in iter(int, 1))
    return [
        text for text, _ in zip((t for t in drawn if t.count(" ") > 1), range(count), strict=False)
    ]
