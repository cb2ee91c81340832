"""Speak by RHVoice, its library in this process: statistical voices, learnt from CMU's recordings.

`RHVOICE` names a folder with `lib`, `data` and `conf`; without it the system's own are used.
"""

import ctypes
import os
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from training.voices.clip import SpokenClip, Style, resample
from training.voices.errors import EngineMissing, SynthesisFailed

ENGINE: Final = "rhvoice"
VOICES: Final = ("Bdl", "Clb", "Slt", "Ksp")
HELD_OUT: Final = "Alan"
"""A Scotsman, kept for judging."""
ROOT: Final = "RHVOICE"
_SOURCE: Final = "https://github.com/RHVoice/RHVoice at 1.14.0"
_BY: Final = f"build it, name its folder in {ROOT}:"
_SYSTEM: Final = ("", "/usr/share/RHVoice", "/etc/RHVoice")
_LIBRARIES: Final = ("libRHVoice_core.so.10", "libRHVoice.so.5")
_TEXT_PLAIN, _FREE_RATE = 0, 1
_POINTER, _TEXT = ctypes.c_void_p, ctypes.c_char_p
_RateTold = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, _POINTER)
_Played = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_uint, _POINTER
)  # fmt: skip


class _Engine(ctypes.Structure):
    """Mirror RHVoice_init_params of RHVoice.h."""

    _fields_ = [
        ("data_path", _TEXT),
        ("config_path", _TEXT),
        ("resource_paths", _POINTER),
        ("set_sample_rate", _RateTold),
        ("play_speech", _Played),
        ("other_callbacks", _POINTER * 7),
        ("options", ctypes.c_uint),
    ]


class _Asked(ctypes.Structure):
    """Mirror RHVoice_synth_params of RHVoice.h."""

    _fields_ = [
        ("voice_profile", _TEXT),
        ("absolute_rate_pitch_volume", ctypes.c_double * 3),
        ("relative_rate", ctypes.c_double),
        ("relative_pitch", ctypes.c_double),
        ("relative_volume", ctypes.c_double),
        ("punctuation_mode", ctypes.c_int),
        ("punctuation_list", _TEXT),
        ("capitals_mode", ctypes.c_int),
        ("flags", ctypes.c_int),
    ]


class _Speaker:
    """Hold the engine and what it plays; one thread at a time."""

    def __init__(self, library: Any, data: str, config: str) -> None:
        self._library = library
        self.rate_hz = 0
        self._played: list[bytes] = []
        # The library calls these for as long as it lives.
        self._told = _RateTold(self._tell_rate), _Played(self._play)
        self._settings = _Engine(data.encode(), config.encode(), None, *self._told)
        library.RHVoice_new_tts_engine.restype = _POINTER
        library.RHVoice_new_message.restype = _POINTER
        library.RHVoice_new_message.argtypes = [
            _POINTER, _TEXT, ctypes.c_uint, ctypes.c_int, ctypes.POINTER(_Asked), _POINTER,
        ]  # fmt: skip
        for name in ("RHVoice_speak", "RHVoice_delete_message"):
            getattr(library, name).argtypes = [_POINTER]
        self._engine = library.RHVoice_new_tts_engine(ctypes.byref(self._settings))
        if not self._engine:
            raise EngineMissing(ENGINE, f"the data in {data}", _SOURCE, by=_BY)

    def _tell_rate(self, rate_hz: int, _user: object) -> int:
        self.rate_hz = rate_hz
        return 1

    def _play(self, samples: Any, count: int, _user: object) -> int:
        self._played.append(ctypes.string_at(samples, 2 * count))
        return 1

    def say(self, text: str, asked: _Asked) -> bytes:
        """Return 16-bit samples; nothing where it does not know the voice."""
        self._played.clear()
        told = text.encode()
        message = self._library.RHVoice_new_message(
            self._engine, told, len(told), _TEXT_PLAIN, ctypes.byref(asked), None
        )
        if not message:
            return b""
        try:
            self._library.RHVoice_speak(message)
            return b"".join(self._played)
        finally:
            self._library.RHVoice_delete_message(message)


@cache
def _speaker() -> _Speaker:
    root = os.environ.get(ROOT)
    folders = [str(Path(root) / name) for name in ("lib", "data", "conf")] if root else _SYSTEM
    libraries, data, config = folders
    try:
        for name in _LIBRARIES:
            loaded = ctypes.CDLL(str(Path(libraries) / name), mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise EngineMissing(ENGINE, f"its library ({error})", _SOURCE, by=_BY) from error
    return _Speaker(loaded, data, config)


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text by one of VOICES or HELD_OUT; it tells no times and knows no liveliness.

    Raises:
        EngineMissing: the library or its data is not installed.
        SynthesisFailed: there is no such voice, or it gave no sound.
    """
    asked = _Asked(
        voice_profile=voice.encode(),
        relative_rate=style.rate_ratio,
        relative_pitch=style.pitch_ratio,
        relative_volume=1.0,
        flags=_FREE_RATE,
    )
    speaker = _speaker()
    samples = np.frombuffer(speaker.say(text, asked), "<i2").astype(np.float32)
    if not samples.any():
        raise SynthesisFailed(ENGINE, voice, text, f"no sound; there are {(*VOICES, HELD_OUT)}")
    samples = resample(samples / np.float32(32_768), speaker.rate_hz)
    return SpokenClip(text=text, engine=ENGINE, voice=voice, samples=samples)
