"""Speak by hibari, a small neural engine whose package brings one voice: a woman's, American."""

from functools import cache
from importlib import import_module
from typing import Any, Final

import numpy as np

import vla_deploy.inference.runtime  # noqa: F401 (switches telemetry off before hibari loads it)
from training.voices.clip import SpokenClip, Style, resample
from training.voices.errors import SynthesisFailed
from training.voices.packaged import packaged

ENGINE: Final = "hibari"
VOICES: Final = ("heart",)
_RATE_HZ: Final = 24_000


@cache
def _speaker() -> Any:
    with packaged(ENGINE, "hibari-tts"):
        return import_module("hibari").Hibari(voice=VOICES[0], threads=1)


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text; it tells no times and keeps its own pitch.

    Raises:
        EngineMissing: its package is not installed.
        SynthesisFailed: it gave no sound.
    """
    seed = round(1_000 * style.lively)
    samples = np.asarray(_speaker()(text, speed=style.rate_ratio, seed=seed), np.float32)
    if not samples.any():
        raise SynthesisFailed(ENGINE, voice, text, "no sound")
    samples = resample(np.clip(samples, -1.0, 1.0), _RATE_HZ)
    return SpokenClip(text=text, engine=ENGINE, voice=voice, samples=samples)
