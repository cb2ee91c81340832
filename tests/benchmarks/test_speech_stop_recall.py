from collections import deque
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from benchmarks.speech_stop_recall import Glances, Recall, RecallingReader, spoken
from drivers.clock import NS_PER_S
from training.stop_words.cast import PARTS
from training.voices.clip import Clip, Style
from vla_deploy.speech.reading import Alternative, Reading
from vla_deploy.speech.readings import FAST_NS
from vla_deploy.speech.sound import Sound

SOUND = np.linspace(-1.0, 1.0, 1600, dtype=np.float32)
TOOK_NS: Final = NS_PER_S // 16


class Recogniser:
    """Read anything, and count how often."""

    def __init__(self) -> None:
        self.count = 0
        self.lately_ns: deque[int] = deque(maxlen=16)

    def read(self, samples: Sound, hot_words: str, earlier: Sound) -> Reading:
        self.count += 1
        self.lately_ns.append(TOOK_NS)
        return Reading(
            text=f"{len(samples)} {hot_words} {len(earlier)}",
            log_probability=-0.1 * self.count,
            no_speech=0.25,
            compression=1.0,
            language="en",
            duration_s=0.1,
            took_s=TOOK_NS / NS_PER_S,
            others=(Alternative("another", 0.5),),
            stop_surety=0.3,
        )


def ask(path: Path, glances: Glances = Glances.MEASURED) -> tuple[list[Reading], Recogniser, float]:
    """Return what is read, by whom, and what was recalled of it in seconds."""
    recogniser = Recogniser()
    with closing(Recall(path)) as recall:
        reader = RecallingReader(recogniser.lately_ns, recall, glances)
        futures = [
            reader.submit(recogniser.read, SOUND, "", SOUND[:count]) for count in (0, 100, 100)
        ]
        return [one.result() for one in futures], recogniser, reader.recalled_s()


def test_what_was_read_once_is_not_read_again(tmp_path: Path) -> None:
    first, reader, recalled_s = ask(tmp_path / "kept")
    assert reader.count == 2
    assert recalled_s == TOOK_NS / NS_PER_S
    assert first[0] != first[1]
    again, reader, recalled_s = ask(tmp_path / "kept")
    assert again == first
    assert reader.count == 0
    assert recalled_s == 3 * TOOK_NS / NS_PER_S


def test_what_is_recalled_counts_as_long_as_it_took(tmp_path: Path) -> None:
    ask(tmp_path / "kept")
    _, reader, _ = ask(tmp_path / "kept")
    assert list(reader.lately_ns) == [TOOK_NS] * 3


@pytest.mark.parametrize(("glances", "slow"), [(Glances.ALWAYS, 0), (Glances.NEVER, 16)])
def test_a_fast_or_a_busy_computer_is_feigned(glances: Glances, slow: int, tmp_path: Path) -> None:
    _, reader, _ = ask(tmp_path / "kept", glances)
    assert sum(took_ns > FAST_NS for took_ns in reader.lately_ns) == slow
    assert len(reader.lately_ns) == slow


def test_a_voice_says_again_what_it_said(tmp_path: Path) -> None:
    espeak = next(one for one in PARTS if one.engine == "espeak")
    asked: list[str] = []

    def speak(text: str, voice: str, style: Style) -> Clip:
        asked.append(text)
        return espeak.speak(text, voice, style)

    said = []
    for _ in range(2):
        with closing(Recall(tmp_path / "kept")) as recall:
            part = replace(espeak, speak=speak)
            said.append(spoken(recall, part, "hello", espeak.voices[0], Style()))
    assert asked == ["hello"]
    assert np.array_equal(said[0].samples, said[1].samples)
    assert said[0].sounds == said[1].sounds
    assert said[0].text == said[1].text == "hello"
