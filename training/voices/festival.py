"""Speak by festival: one program for many texts, since starting it costs most."""

import io
import shutil
import subprocess
import tempfile
import wave
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from training.voices.clip import Sound, SpokenClip, Style, resample
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.phones import SILENCE, from_dictionary

ENGINE: Final = "festival"
VOICES: Final = {
    "kal_diphone": "festvox-kallpc16k",
    "ked_diphone": "festvox-kdlpc16k",
    "cmu_us_slt_arctic_hts": "festvox-us-slt-hts",
}
_TIMEOUT_S_PER_TEXT: Final = 10.0
_FOLDERS: Final = ("/usr/share/festival/voices/english", "/usr/share/festival/voices/us")


def speak_all(wishes: Sequence[tuple[str, str, Style]]) -> list[SpokenClip]:
    """Speak texts, each by one of VOICES in a style, and return them in order.

    Raises:
        EngineMissing: festival or a voice is not installed.
        SynthesisFailed: one of the texts gave no sound.
    """
    program = shutil.which("festival")
    if program is None:
        raise EngineMissing(ENGINE, "the program festival", "festival")
    for voice in {voice for _, voice, _ in wishes}:
        if not any((Path(folder) / voice).is_dir() for folder in _FOLDERS):
            raise EngineMissing(ENGINE, f"the voice {voice}", VOICES.get(voice, "festvox-*"))
    with tempfile.TemporaryDirectory() as folder:
        script = "\n".join(_lines(Path(folder), wishes))
        done = subprocess.run(
            [program, "--pipe"],
            input=script.encode(),
            capture_output=True,
            timeout=_TIMEOUT_S_PER_TEXT * len(wishes) + 30.0,
            check=False,
        )
        told = done.stderr.decode(errors="replace").strip()
        return [_read(Path(folder), number, *wish, told) for number, wish in enumerate(wishes)]


def _lines(folder: Path, wishes: Sequence[tuple[str, str, Style]]) -> list[str]:
    lines = []
    for number, (text, voice, style) in enumerate(wishes):
        quoted = text.replace("\\", "").replace('"', "")
        lines += [
            f"(voice_{voice})",
            f"(Parameter.set 'Duration_Stretch {1.0 / style.rate_ratio:.3f})",
            f'(set! said (utt.synth (Utterance Text "{quoted}")))',
            f'(utt.save.wave said "{folder / f"{number}.wav"}" \'riff)',
            f'(utt.save.segs said "{folder / f"{number}.seg"}")',
        ]
    return lines


def _read(folder: Path, number: int, text: str, voice: str, _style: Style, told: str) -> SpokenClip:
    path = folder / f"{number}.wav"
    if not path.exists():
        raise SynthesisFailed(ENGINE, voice, text, f"no sound ({told[-200:]})")
    with wave.open(io.BytesIO(path.read_bytes())) as file:
        rate_hz = file.getframerate()
        samples = np.frombuffer(file.readframes(file.getnframes()), np.int16)
    return SpokenClip(
        text=text,
        engine=ENGINE,
        voice=voice,
        samples=resample(samples.astype(np.float32) / np.float32(32_768), rate_hz),
        sounds=_sounds(folder / f"{number}.seg"),
    )


def _sounds(path: Path) -> tuple[Sound, ...]:
    """Read a label file: after a line "#", one "end mark name" a line."""
    rows = path.read_text(encoding="ascii").split("#", 1)[1].split("\n")
    sounds: list[Sound] = []
    began_s = 0.0
    for end, _, name in (row.split()[:3] for row in rows if len(row.split()) >= 3):
        sounds.append(Sound(phone=from_dictionary(name) or SILENCE, began_s=began_s))
        began_s = float(end)
    return tuple(sounds)
