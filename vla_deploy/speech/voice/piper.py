"""Speak by a voice of piper, where its program and the voice are on this computer.

piper-tts is under the GPL: it stays a process of its own, and nothing here fetches it.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.speech.voice.clip import Clip
from vla_deploy.speech.voice.engine import run_program
from vla_deploy.speech.voice.errors import EngineMissing
from vla_deploy.speech.voice.wav_stream import pcm_wave

PROGRAM: Final = "piper"
PLAIN_PACE_WORDS_PER_MINUTE: Final = 160
_REMEDY: Final = (
    "install it beside the robot's software (pipx install piper-tts), or speak by espeak-ng"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PiperEngine:
    """Be one voice of piper: the path of its .onnx, with its .onnx.json beside it."""

    voice: str
    words_per_minute: int = PLAIN_PACE_WORDS_PER_MINUTE
    program: str = PROGRAM

    @property
    def name(self) -> str:
        """Return the engine and its voice."""
        return f"piper, {Path(self.voice).stem}"

    def synthesise(self, text: str) -> Clip:
        """Return the sound of a text, after a second or more on a small computer.

        Raises:
            EngineMissing: the program or the voice is not on this computer.
            SynthesisFailed: it gives no sound.
        """
        rate_hz = self._rate_hz()
        slowness = PLAIN_PACE_WORDS_PER_MINUTE / self.words_per_minute
        words = (
            *(self.program, "--model", self.voice, "--output_raw"),
            *("--length_scale", f"{slowness:.3f}"),
        )
        spoken = run_program(words, " ".join(text.split()) + "\n", _REMEDY)
        return Clip(rate_hz=rate_hz, wave=pcm_wave(spoken))

    def _rate_hz(self) -> int:
        described = Path(f"{self.voice}.json")
        if not Path(self.voice).is_file():
            raise EngineMissing(f"{self.voice}: no such voice; expected the path of a piper .onnx")
        try:
            return int(json.loads(described.read_text(encoding="utf-8"))["audio"]["sample_rate"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise EngineMissing(
                f"{described}: expected piper's description with audio.sample_rate, got {error!r}; "
                "it comes with the voice"
            ) from error
