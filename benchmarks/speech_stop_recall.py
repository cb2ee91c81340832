"""Keep what voices said and what the recogniser read in it, and have it again at once.

Other bounds on the same readings are then judged in a fraction of the time. A file is good for the
models, the recogniser and the voices that it was made with: after a change of these begin another.
"""

import hashlib
import json
import sqlite3
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from training.stop_words.cast import Part
from training.voices.clip import Clip, Sound, Style
from vla_deploy.aside import AtOnce
from vla_deploy.speech.reading import Alternative, Reading
from vla_deploy.speech.readings import FAST_NS
from vla_deploy.speech.recogniser import LATELY

_TABLE: Final = "CREATE TABLE IF NOT EXISTS answers (asked BLOB PRIMARY KEY, answer BLOB) STRICT"


class Glances(StrEnum):
    """Say whether there is time to read what has been said so far while somebody goes on.

    Without regard to this computer, what is missed tells of a fast one or of a busy one.
    """

    MEASURED = "measured"
    ALWAYS = "always"
    NEVER = "never"


class Recall:
    """Hold what was answered before, in a file or not at all."""

    def __init__(self, path: Path | None = None) -> None:
        """Open the file, or begin it."""
        self._answers = None if path is None else sqlite3.connect(path, isolation_level=None)
        if self._answers is not None:
            self._answers.execute("PRAGMA synchronous = OFF")
            self._answers.execute(_TABLE)

    def find(self, key: bytes) -> bytes | None:
        """Return what was answered before."""
        if self._answers is None:
            return None
        query = self._answers.execute("SELECT answer FROM answers WHERE asked = ?", (key,))
        found: tuple[bytes] | None = query.fetchone()
        return None if found is None else found[0]

    def keep(self, key: bytes, answer: bytes) -> None:
        """Keep an answer, if there is a file."""
        if self._answers is not None:
            self._answers.execute("INSERT OR REPLACE INTO answers VALUES (?, ?)", (key, answer))

    def close(self) -> None:
        """Close the file."""
        if self._answers is not None:
            self._answers.close()


def key_of(*asked: object) -> bytes:
    """Return what stands for a question, whatever sound is in it."""
    digest = hashlib.sha256()
    for one in asked:
        digest.update(one.tobytes() if isinstance(one, np.ndarray) else repr(one).encode())
        digest.update(b"|")
    return digest.digest()


def spoken(recall: Recall, part: Part, text: str, voice: str, style: Style) -> Clip:
    """Return what a voice says, or said before: some engines never speak twice the same.

    Raises:
        SynthesisFailed: the voice cannot say it.
    """
    key = key_of(part.engine, text, voice, style)
    before = recall.find(key)
    if before is not None:
        head, _, samples = before.partition(b"\n")
        told = json.loads(head)
        sounds = tuple(Sound(**one) for one in told.pop("sounds"))
        return Clip(**told, sounds=sounds, samples=np.frombuffer(samples, np.float32))
    clip = part.speak(text, voice, style)
    told = {"text": clip.text, "engine": clip.engine, "voice": clip.voice}
    told["sounds"] = [asdict(one) for one in clip.sounds]
    recall.keep(key, json.dumps(told).encode() + b"\n" + clip.samples.tobytes())
    return clip


class RecallingReader(AtOnce):
    """Read at once, or as it was read before, and be as fast as is wanted."""

    def __init__(self, lately_ns: deque[int], recall: Recall, glances: Glances) -> None:
        """Take the recogniser's last readings along, by which it is judged fast or not."""
        self._lately_ns = lately_ns
        self._recall = recall
        self._glances = glances
        self._recalled_s = 0.0
        self._pretend()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Return a future that is done, of what the recogniser reads in `args`."""
        return super().submit(self._read, fn, args)

    def recalled_s(self) -> float:
        """Return what the readings from before took since the last call."""
        recalled_s, self._recalled_s = self._recalled_s, 0.0
        return recalled_s

    def _read(self, read: Callable[..., Reading], args: tuple[Any, ...]) -> Reading:
        key = key_of(*args)
        before = self._recall.find(key)
        if before is None:
            reading = read(*args)
            self._recall.keep(key, json.dumps(asdict(reading)).encode())
        else:
            told = json.loads(before)
            others = tuple(Alternative(**one) for one in told.pop("others"))
            reading = Reading(**told, others=others)
            self._recalled_s += reading.took_s
            self._lately_ns.append(round(reading.took_s * NS_PER_S))
        self._pretend()
        return reading

    def _pretend(self) -> None:
        if self._glances is Glances.ALWAYS:
            self._lately_ns.clear()
        elif self._glances is Glances.NEVER:
            self._lately_ns.extend([FAST_NS + 1] * LATELY)
