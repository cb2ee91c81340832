"""Speak by SVOX Pico, from the package py-nanotts, which brings its voices."""

from functools import cache
from importlib import import_module
from typing import Any, Final

import numpy as np

from training.voices.clip import SpokenClip, Style, resample
from training.voices.errors import SynthesisFailed
from training.voices.packaged import packaged

ENGINE: Final = "pico"
VOICES: Final = ("en-US", "en-GB")
_RATE_HZ: Final = 16_000


@cache
def _speaker() -> Any:
    with packaged(ENGINE, "py-nanotts"):
        return import_module("py_nanotts").NanoTTS()


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text by one of VOICES; it tells no times and knows no liveliness.

    Raises:
        EngineMissing: its package is not installed.
        SynthesisFailed: it gave no sound.
    """
    told = _speaker().speak(text, voice=voice, speed=style.rate_ratio, pitch=style.pitch_ratio)
    samples = np.frombuffer(told, "<i2").astype(np.float32) / np.float32(32_768)
    if not samples.any():
        raise SynthesisFailed(ENGINE, voice, text, "no sound")
    return SpokenClip(text=text, engine=ENGINE, voice=voice, samples=resample(samples, _RATE_HZ))
