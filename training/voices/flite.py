"""Speak by flite, its libraries in this process: recorded diphones and statistical voices."""

import ctypes
from functools import cache
from typing import Any, Final

import numpy as np

from training.voices.clip import Sound, SpokenClip, Style, resample
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.phones import SILENCE, from_dictionary

ENGINE: Final = "flite"
_PACKAGES: Final = "flite"
# flite keeps the pointers to names of features: they must live as long as the library.
_STRETCH, _PITCH, _SPREAD, _SHIFT = (
    b"duration_stretch", b"int_f0_target_mean", b"int_f0_target_stddev", b"f0_shift",
)  # fmt: skip
# Mean pitch of each speaker: what a pitch ratio of one asks for.
PITCH_HZ: Final = {"kal": 95.0, "kal16": 95.0, "awb": 126.0, "rms": 100.0, "slt": 167.0}


class _Wave(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_char_p),
        ("rate_hz", ctypes.c_int),
        ("count", ctypes.c_int),
        ("channels", ctypes.c_int),
        ("samples", ctypes.POINTER(ctypes.c_short)),
    ]


class _Voice(ctypes.Structure):
    """Mirror the beginning of cst_voice."""

    _fields_ = [("name", ctypes.c_char_p), ("features", ctypes.c_void_p)]


_POINTER, _TEXT = ctypes.c_void_p, ctypes.c_char_p
_FUNCTIONS: Final = {
    "flite_synth_text": (_POINTER, [_TEXT, _POINTER]),
    "utt_wave": (ctypes.POINTER(_Wave), [_POINTER]),
    "utt_relation": (_POINTER, [_POINTER, _TEXT]),
    "relation_head": (_POINTER, [_POINTER]),
    "item_next": (_POINTER, [_POINTER]),
    "item_feat_string": (_TEXT, [_POINTER, _TEXT]),
    "item_feat_float": (ctypes.c_float, [_POINTER, _TEXT]),
    "feat_set_float": (None, [_POINTER, _TEXT, ctypes.c_float]),
    "delete_utterance": (None, [_POINTER]),
}


def _load(name: str) -> Any:
    try:
        return ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise EngineMissing(ENGINE, name, _PACKAGES) from error


@cache
def _library() -> Any:
    library = _load("libflite.so.1")
    for name in ("libflite_usenglish.so.1", "libflite_cmulex.so.1"):
        _load(name)
    for name, (result, arguments) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    library.flite_init()
    return library


@cache
def _voice(name: str) -> Any:
    """Return the voice's address."""
    register = getattr(_load(f"libflite_cmu_us_{name}.so.1"), f"register_cmu_us_{name}")
    register.restype, register.argtypes = _POINTER, [_TEXT]
    return register(None)


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text by one of the voices in PITCH_HZ.

    Raises:
        EngineMissing: flite or the voice is not installed.
        SynthesisFailed: there is no such voice, or it gave no sound.
    """
    if voice not in PITCH_HZ:
        raise SynthesisFailed(ENGINE, voice, text, f"no such voice; there are {sorted(PITCH_HZ)}")
    library, address = _library(), _voice(voice)
    features = ctypes.cast(address, ctypes.POINTER(_Voice)).contents.features
    for name, value in (
        (_STRETCH, 1.0 / style.rate_ratio),
        (_PITCH, PITCH_HZ[voice] * style.pitch_ratio),
        (_SPREAD, 30.0 * style.lively),
        (_SHIFT, 1.0 if voice.startswith("kal") else style.pitch_ratio),
    ):
        library.feat_set_float(features, name, value)
    spoken = library.flite_synth_text(text.encode(), address)
    if not spoken:
        raise SynthesisFailed(ENGINE, voice, text, "no sound")
    try:
        wave = library.utt_wave(spoken).contents
        if wave.count <= 0:
            raise SynthesisFailed(ENGINE, voice, text, "no sound")
        samples = np.ctypeslib.as_array(wave.samples, (wave.count,)).astype(np.float32)
        return SpokenClip(
            text=text,
            engine=ENGINE,
            voice=voice,
            samples=resample(samples / np.float32(32_768), wave.rate_hz),
            sounds=_sounds(library, spoken),
        )
    finally:
        library.delete_utterance(spoken)


def _sounds(library: Any, spoken: Any) -> tuple[Sound, ...]:
    """Read when each sound begins: where the one before it ends."""
    item = library.relation_head(library.utt_relation(spoken, b"Segment"))
    sounds: list[Sound] = []
    began_s = 0.0
    while item:
        phone = from_dictionary(library.item_feat_string(item, b"name").decode())
        sounds.append(Sound(phone=phone or SILENCE, began_s=began_s))
        began_s = library.item_feat_float(item, b"end")
        item = library.item_next(item)
    return tuple(sounds)
