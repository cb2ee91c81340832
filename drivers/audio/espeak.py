"""Turn text into sound by eSpeak NG: a process of its own, as it is under the GPL."""

import shutil
import subprocess
from dataclasses import dataclass
from typing import Final

from drivers.audio.clip import Clip, read_wav_stream
from drivers.errors import VoiceError

TIMEOUT_S: Final = 10.0
ESPEAK: Final = "espeak-ng"
_REMEDY: Final = "install it: apt install espeak-ng, or scripts/system-packages"


@dataclass(frozen=True, slots=True, kw_only=True)
class EspeakEngine:
    """Be one voice of eSpeak NG, such as "en-gb" or "en-us+f4"; `pitch` is 0..99."""

    voice: str = "en-gb"
    words_per_minute: int = 160
    pitch: int = 50
    program: str = ESPEAK

    def missing(self) -> str:
        """Return why it cannot speak, and what to do; empty where it is installed."""
        return "" if shutil.which(self.program) else f"{self.program}: no such program; {_REMEDY}"

    def synthesise(self, text: str) -> Clip:
        """Return the sound of a text, after some 20 to 100 ms.

        Raises:
            VoiceError: eSpeak NG is not installed, has no such voice, or gives no sound in 10 s.
        """
        words = (
            *(self.program, "--stdin", "--stdout", "-b", "1"),
            *("-v", self.voice, "-s", str(self.words_per_minute), "-p", str(self.pitch)),
        )
        # Its brackets would switch to phonemes.
        plain = text.replace("[[", " ").replace("]]", " ")
        try:
            ran = subprocess.run(
                words, input=plain.encode(), capture_output=True, timeout=TIMEOUT_S, check=False
            )
        except subprocess.TimeoutExpired as error:
            raise VoiceError(f"{self.program}: no sound within {TIMEOUT_S:g} s") from error
        except OSError as error:
            raise VoiceError(f"{self.program}: {error.strerror}; {_REMEDY}") from error
        if ran.returncode:
            told = " ".join(ran.stderr.decode(errors="replace").split()) or "it says nothing"
            raise VoiceError(f"{self.program} ended with {ran.returncode}: {told}")
        return read_wav_stream(ran.stdout)
