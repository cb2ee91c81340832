"""Speak by eSpeak NG, as a process of its own: it is under the GPL, and this package is not."""

from dataclasses import dataclass
from typing import Final

from vla_deploy.speech.voice.clip import Clip
from vla_deploy.speech.voice.engine import run_program
from vla_deploy.speech.voice.wav_stream import read_wav_stream

PROGRAM: Final = "espeak-ng"
_REMEDY: Final = "install it: apt install espeak-ng, or scripts/system-packages"


@dataclass(frozen=True, slots=True, kw_only=True)
class EspeakEngine:
    """Be one voice of eSpeak NG, such as "en-gb" or "en-us+f4"; `pitch` is 0..99."""

    voice: str = "en-gb"
    words_per_minute: int = 160
    pitch: int = 50
    program: str = PROGRAM

    @property
    def name(self) -> str:
        """Return the engine and its voice."""
        return f"eSpeak NG, {self.voice}"

    def synthesise(self, text: str) -> Clip:
        """Return the sound of a text, after some 20 to 100 ms.

        Raises:
            EngineMissing: eSpeak NG is not installed.
            SynthesisFailed: it has no such voice, or gives no sound.
        """
        words = (
            *(self.program, "--stdin", "--stdout", "-b", "1"),
            *("-v", self.voice, "-s", str(self.words_per_minute), "-p", str(self.pitch)),
        )
        return read_wav_stream(run_program(words, _plain(text), _REMEDY))


def _plain(text: str) -> str:
    """Return the text without the brackets that would switch to phonemes."""
    return text.replace("[[", " ").replace("]]", " ")
