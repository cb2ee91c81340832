"""Declare what turns text into sound, and run the programs that do: each a process of its own."""

import subprocess
from collections.abc import Sequence
from typing import Final, Protocol

from vla_deploy.one_line import one_line
from vla_deploy.speech.voice.clip import Clip
from vla_deploy.speech.voice.errors import EngineMissing, SynthesisFailed

TIMEOUT_S: Final = 10.0


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


def run_program(words: Sequence[str], text: str, remedy: str) -> bytes:
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
