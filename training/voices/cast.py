"""List who speaks in training and who is kept for judging; speak for any of them.

A whole engine, festival, is kept: what it says tells how a model does on a synthesiser that it
never heard. Of eSpeak's speakers and accents some are kept too.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from training.voices import espeak, flite, hibari, kokoro, pico, piper
from training.voices.clip import SpokenClip, Style

ACCENTS: Final = (
    "en", "en-us", "en-us-nyc", "en-029", "en-gb-scotland", "en-gb-x-gbclan", "en-gb-x-gbcwmd",
)  # fmt: skip
HELD_OUT_ACCENT: Final = "en-gb-x-rp"
VARIANTS: Final = (
    "adam", "Alex", "Alicia", "Andrea", "Andy", "aunty", "belinda", "benjamin", "boris", "caleb",
    "david", "Denis", "Diogo", "ed", "edward", "edward2", "Gene", "Gene2", "grandma", "grandpa",
    "gustave", "Henrique", "Hugo", "iven", "iven2", "iven3", "Jacky", "john", "kaukovalta",
    "klatt", "klatt2", "klatt4", "klatt5", "klatt6", "linda", "marcelo", "Marco", "mario", "max",
    "michael", "michel", "miguel", "mike", "Mr serious", "Nguyen", "norbert", "pablo", "paul",
    "pedro", "quincy", "rob", "robert", "sandro", "shelby", "steph", "steph3", "travis", "Tweaky",
    "victor", "zac", "anika", "f1", "f2", "f3", "f5", "m1", "m2", "m3", "m4", "m6", "m7", "m8",
)  # fmt: skip
ROBOTIC_VARIANTS: Final = ("RicishayMax", "robosoft", "robosoft3", "UniRobot", "Storm", "croak")
HELD_OUT_VARIANTS: Final = ("f4", "m5", "Annie", "Lee", "steph2", "klatt3", "iven4", "antonio")
FLITE_SHARE: Final = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Speaker:
    """Name one voice of one engine."""

    engine: str
    voice: str


_ENGINES: Final[Mapping[str, Callable[[str, str, Style], SpokenClip]]] = {
    espeak.ENGINE: espeak.speak,
    flite.ENGINE: flite.speak,
    pico.ENGINE: pico.speak,
    hibari.ENGINE: hibari.speak,
    piper.ENGINE: piper.speak,
    kokoro.ENGINE: kokoro.speak,
}


def say(text: str, speaker: Speaker, style: Style) -> SpokenClip:
    """Speak a text by one of the engines that run in this process.

    Raises:
        EngineMissing: it is not installed.
        SynthesisFailed: there is no such voice, or nothing to say.
    """
    return _ENGINES[speaker.engine](text, speaker.voice, style)


def draw_speaker(random: np.random.Generator, flite_share: float = FLITE_SHARE) -> Speaker:
    """Draw one of those who speak in training."""
    if random.random() < flite_share:
        return Speaker(engine=flite.ENGINE, voice=str(random.choice(list(flite.PITCH_HZ))))
    accent = str(random.choice(ACCENTS, p=_ACCENT_SHARES))
    draw = random.random()
    if draw < 0.1:
        return Speaker(engine=espeak.ENGINE, voice=accent)
    variants = ROBOTIC_VARIANTS if draw < 0.14 else VARIANTS
    return Speaker(engine=espeak.ENGINE, voice=f"{accent}+{random.choice(variants)}")


# American speech is what most other engines speak.
_ACCENT_SHARES: Final = tuple(
    0.4 if accent == "en-us" else 0.6 / (len(ACCENTS) - 1) for accent in ACCENTS
)


def draw_of_all(random: np.random.Generator) -> Speaker:
    """Draw one of all engines but festival; those whose speech is natural more than their share."""
    engine = str(random.choice(list(_ENGINE_SHARES), p=list(_ENGINE_SHARES.values())))
    if engine in PACKAGED_VOICES:
        return Speaker(engine=engine, voice=str(random.choice(PACKAGED_VOICES[engine])))
    return draw_speaker(random, float(engine == flite.ENGINE))


_ENGINE_SHARES: Final = {
    kokoro.ENGINE: 0.5, espeak.ENGINE: 0.24, flite.ENGINE: 0.1, pico.ENGINE: 0.06,
    hibari.ENGINE: 0.05, piper.ENGINE: 0.05,
}  # fmt: skip
PACKAGED_VOICES: Final = {
    kokoro.ENGINE: kokoro.VOICES, pico.ENGINE: pico.VOICES, hibari.ENGINE: hibari.VOICES,
    piper.ENGINE: piper.VOICES,
}  # fmt: skip


def draw_held_out(random: np.random.Generator) -> Speaker:
    """Draw an eSpeak voice that training never heard: the speaker, and at times the accent."""
    accent = HELD_OUT_ACCENT if random.random() < 0.25 else str(random.choice(ACCENTS))
    return Speaker(engine=espeak.ENGINE, voice=f"{accent}+{random.choice(HELD_OUT_VARIANTS)}")


def draw_style(random: np.random.Generator) -> Style:
    """Draw how somebody speaks: slow to hurried, low to high, flat to lively."""
    return Style(
        rate_ratio=float(np.exp(random.normal(0.0, 0.16)).clip(0.68, 1.4)),
        pitch_ratio=float(np.exp(random.normal(0.0, 0.25)).clip(0.55, 1.7)),
        lively=float(random.uniform(0.15, 0.95)),
    )
