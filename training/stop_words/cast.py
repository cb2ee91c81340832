"""List how much each synthesiser says, and which of its voices are kept to judge by."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from training.voices import espeak, festival, flite, hibari, kokoro, pico, piper, rhvoice
from training.voices.cast import (
    ACCENTS,
    HELD_OUT_ACCENT,
    HELD_OUT_VARIANTS,
    ROBOTIC_VARIANTS,
    VARIANTS,
)
from training.voices.clip import SpokenClip, Style

Speak = Callable[[str, str, Style], SpokenClip]


def _festival(text: str, voice: str, style: Style) -> SpokenClip:
    return festival.speak_all([(text, voice, style)])[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class CastPart:
    """Say how many clips one engine speaks, with stop words and without, to train and to judge.

    `share` is how often a clip of it is learnt from, against those of the others; `held` voices
    choose the model and its thresholds, `judged` ones nothing. `tells_times` is false where only
    words that come first or last can be used.
    """

    engine: str
    speak: Speak
    tells_times: bool
    share: float = 0.0
    voices: tuple[str, ...] = ()
    stops: int = 0
    others: int = 0
    held_voices: tuple[str, ...] = ()
    held_stops: int = 0
    held_others: int = 0
    judged_voices: tuple[str, ...] = ()
    judged_stops: int = 0
    judged_others: int = 0


PARTS: Final = (
    CastPart(
        engine=kokoro.ENGINE,
        speak=kokoro.speak,
        tells_times=True,
        share=0.6,
        voices=kokoro.VOICES,
        stops=1000,
        others=500,
        held_voices=kokoro.DEVELOPMENT,
        held_stops=180,
        held_others=400,
        judged_voices=kokoro.JUDGED,
        judged_stops=200,
        judged_others=400,
    ),
    CastPart(
        engine=espeak.ENGINE,
        speak=espeak.speak,
        tells_times=True,
        share=0.1,
        voices=tuple(f"{a}+{v}" for a in ACCENTS for v in (*VARIANTS, *ROBOTIC_VARIANTS)),
        stops=8000,
        others=10000,
        held_voices=(
            *(f"{accent}+{variant}" for accent in ACCENTS for variant in HELD_OUT_VARIANTS),
            *(f"{HELD_OUT_ACCENT}+{variant}" for variant in VARIANTS),
        ),
        held_stops=400,
        held_others=900,
    ),
    CastPart(
        engine=flite.ENGINE,
        speak=flite.speak,
        tells_times=True,
        share=0.12,
        voices=tuple(flite.PITCH_HZ),
        stops=4000,
        others=7000,
    ),
    CastPart(
        engine=pico.ENGINE,
        speak=pico.speak,
        tells_times=False,
        share=0.07,
        voices=("en-US",),
        stops=2000,
        others=6000,
        held_voices=("en-GB",),
        held_stops=120,
        held_others=300,
    ),
    CastPart(
        engine=rhvoice.ENGINE,
        speak=rhvoice.speak,
        tells_times=False,
        share=0.12,
        voices=rhvoice.VOICES,
        stops=3000,
        others=6000,
        held_voices=(rhvoice.HELD_OUT,),
        held_stops=120,
        held_others=300,
    ),
    CastPart(
        engine=hibari.ENGINE,
        speak=hibari.speak,
        tells_times=False,
        share=0.07,
        voices=hibari.VOICES,
        stops=2000,
        others=7000,
    ),
    CastPart(
        engine=piper.ENGINE,
        speak=piper.speak,
        tells_times=False,
        share=0.07,
        voices=piper.VOICES,
        stops=1600,
        others=2500,
    ),
    CastPart(
        engine=festival.ENGINE,
        speak=_festival,
        tells_times=True,
        held_voices=tuple(festival.VOICES),
        held_stops=150,
        held_others=200,
    ),
)
"""Festival is judged by and never learnt from."""


def draw_style(random: np.random.Generator) -> Style:
    """Draw how somebody speaks who may be in a hurry to stop a robot, or drawl."""
    return Style(
        rate_ratio=float(random.uniform(0.7, 1.4)),
        pitch_ratio=float(np.exp(random.uniform(-0.45, 0.45))),
        lively=float(random.uniform(0.15, 0.95)),
    )


SHARES: Final[Mapping[str, float]] = {part.engine: part.share for part in PARTS}
