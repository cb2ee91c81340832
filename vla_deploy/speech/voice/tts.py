"""Turn text into sound by eSpeak NG or piper: each a process of its own, as they are under the GPL.

Nothing here fetches a program or a voice.
"""

import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from vla_deploy.one_line import one_line
from vla_deploy.robots.description import VoiceSettings
from vla_deploy.speech.errors import EngineMissing, SynthesisFailed
from vla_deploy.speech.voice.clip import Clip, pcm_wave, read_wav_stream

TIMEOUT_S: Final = 10.0
ESPEAK: Final = "espeak-ng"
PIPER: Final = "piper"
PLAIN_PACE_WORDS_PER_MINUTE: Final = 160
_ESPEAK_REMEDY: Final = "install it: apt install espeak-ng, or scripts/system-packages"
_PIPER_REMEDY: Final = (
    "install it beside the robot's software (pipx install piper-tts), or speak by espeak-ng"
)


class Engine(Protocol):
    """Be one voice."""

    @property
    def name(self) -> str:
        """Return the engine and its voice, for people."""
        ...

    def synthesise(self, text: str) -> Clip:
        """Return the sound of a text; takes tens of milliseconds, or as long as the engine needs.

        Raises:
            EngineMissing: the program or the voice is not here.
            SynthesisFailed: it gives no sound.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class EspeakEngine:
    """Be one voice of eSpeak NG, such as "en-gb" or "en-us+f4"; `pitch` is 0..99."""

    voice: str = "en-gb"
    words_per_minute: int = 160
    pitch: int = 50
    program: str = ESPEAK

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
        # Its brackets would switch to phonemes.
        plain = text.replace("[[", " ").replace("]]", " ")
        return read_wav_stream(_run_program(words, plain, _ESPEAK_REMEDY))


@dataclass(frozen=True, slots=True, kw_only=True)
class PiperEngine:
    """Be one voice of piper: the path of its .onnx, with its .onnx.json beside it."""

    voice: str
    words_per_minute: int = PLAIN_PACE_WORDS_PER_MINUTE
    program: str = PIPER

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
        spoken = _run_program(words, " ".join(text.split()) + "\n", _PIPER_REMEDY)
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


def chosen_engine(settings: VoiceSettings) -> Engine:
    """Return the engine of a robot file; whether it is installed shows when it first speaks."""
    if settings.engine == PIPER:
        return PiperEngine(
            voice=settings.voice,
            words_per_minute=settings.words_per_minute,
            program=settings.program or PIPER,
        )
    return EspeakEngine(
        voice=settings.voice,
        words_per_minute=settings.words_per_minute,
        pitch=settings.pitch,
        program=settings.program or ESPEAK,
    )


def _run_program(words: Sequence[str], text: str, remedy: str) -> bytes:
    """Hand a text to a program's input and return what it writes.

    Raises:
        EngineMissing: there is no such program; `remedy` says what to try.
        SynthesisFailed: it fails, or takes longer than 10 s.
    """
    try:
        ran = subprocess.run(
            words, input=text.encode(), capture_output=True, timeout=TIMEOUT_S, check=False
        )
    except FileNotFoundError as error:
        raise EngineMissing(f"{words[0]}: no such program; {remedy}") from error
    except subprocess.TimeoutExpired as error:
        raise SynthesisFailed(f"{words[0]}: no sound within {TIMEOUT_S:g} s") from error
    except OSError as error:
        raise EngineMissing(f"{words[0]}: {error.strerror}; {remedy}") from error
    if ran.returncode:
        told = one_line(ran.stderr.decode(errors="replace")) or "it says nothing"
        raise SynthesisFailed(f"{words[0]} ended with {ran.returncode}: {told}")
    return ran.stdout
