"""Speak by eSpeak NG, its library in this process: milliseconds a sentence, each sound timed."""

import ctypes
from functools import cache
from typing import Any, Final

import numpy as np

from training.voices.clip import Sound, SpokenClip, Style, resample
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.phones import from_espeak

ENGINE: Final = "espeak"
_LIBRARY: Final = "libespeak-ng.so.1"
_SYNCHRONOUS, _PHONEME_EVENTS = 2, 1
_ENDS, _PHONEME = 0, 7
_RATE, _PITCH, _RANGE = 1, 3, 4
_UTF8: Final = 1
_WORDS_PER_MINUTE: Final = 165
_MIDDLE_PITCH: Final = 50


class _Name(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    """Mirror espeak_EVENT of speak_lib.h."""

    _fields_ = [
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Name),
    ]


_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)


class _Speaker:
    """Hold the one library of the process; it cannot be opened twice."""

    def __init__(self) -> None:
        try:
            self._library: Any = ctypes.CDLL(_LIBRARY)
        except OSError as error:
            raise EngineMissing(ENGINE, _LIBRARY, "libespeak-ng1") from error
        self._rate_hz = self._library.espeak_Initialize(_SYNCHRONOUS, 0, None, _PHONEME_EVENTS)
        if self._rate_hz <= 0:
            raise EngineMissing(ENGINE, "its data", "espeak-ng-data")
        self._pieces: list[np.ndarray[Any, np.dtype[np.int16]]] = []
        self._sounds: list[Sound] = []
        # The library keeps the pointer alone: it must live as long as this.
        self._callback = _Callback(self._take)
        self._library.espeak_SetSynthCallback(self._callback)

    def _take(self, samples: Any, count: int, events: Any) -> int:
        if samples and count:
            self._pieces.append(np.ctypeslib.as_array(samples, (count,)).copy())
        number = 0
        while events[number].type != _ENDS:
            event = events[number]
            number += 1
            if event.type != _PHONEME:
                continue
            phone = from_espeak(event.id.string.decode("utf-8", "replace"))
            if phone is not None:
                self._sounds.append(Sound(phone=phone, began_s=event.sample / self._rate_hz))
        return 0

    def speak(self, text: str, voice: str, style: Style) -> SpokenClip:
        """Speak one text."""
        self._pieces.clear()
        self._sounds.clear()
        # An unknown name leaves the voice of before in place and says so by its result alone.
        if self._library.espeak_SetVoiceByName(voice.encode()) != 0:
            raise SynthesisFailed(ENGINE, voice, text, "no such voice")
        for what, value in (
            (_RATE, round(_WORDS_PER_MINUTE * style.rate_ratio)),
            (_PITCH, round(_MIDDLE_PITCH * style.pitch_ratio)),
            (_RANGE, round(100 * style.lively)),
        ):
            self._library.espeak_SetParameter(what, min(max(value, 0), 450), 0)
        data = text.encode()
        self._library.espeak_Synth(data, len(data) + 1, 0, 0, 0, _UTF8, None, None)
        self._library.espeak_Synchronize()
        if not self._pieces:
            raise SynthesisFailed(ENGINE, voice, text, "no sound")
        samples = np.concatenate(self._pieces).astype(np.float32) / np.float32(32_768)
        return SpokenClip(
            text=text,
            engine=ENGINE,
            voice=voice,
            samples=resample(samples, self._rate_hz),
            sounds=tuple(self._sounds),
        )


@cache
def _speaker() -> _Speaker:
    return _Speaker()


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text by a voice such as "en-us+f3": an accent, and how the speaker sounds.

    Raises:
        EngineMissing: libespeak-ng is not installed.
        SynthesisFailed: there is no such voice, or nothing to say.
    """
    return _speaker().speak(text, voice, style)
