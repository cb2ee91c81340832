"""Measure the robot's voice: whether it hears itself, and how soon a person silences it.

The real speech node in the twin's room: the robot speaks, and people of several voices speak into
what it says, soon after its beginning and later. Needs eSpeak NG, and no recogniser.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, show
from drivers.audio.espeak import EspeakEngine
from sim_twin.harness.speech_room import SpeechRoom
from sim_twin.sound.talker import Talker

SENTENCES: Final = (
    "I have put the red cup into the box",
    "stop, I do not see the green ball on the table",
    "now I drive back to the kitchen table and wait for you",
)
LONG: Final = "so I went on, and on, and on, to the very end of the long way, and then I came back"
PEOPLE: Final = (
    ("en-gb", "robot, come here please"),
    ("en-us+f4", "stop right there"),
    ("en-gb-x-rp+m3", "go to the kitchen"),
    ("en-us", "halt"),
    ("en-gb+f2", "robot stop"),
)
AFTER_S: Final = (0.7, 1.5, 2.3)
PATIENCE_S: Final = 3.0
"""An interruption later than that was none."""


def measure(sentences: int = 12) -> dict[str, Any]:
    """Return the figures."""
    return {"own": _own(sentences), "interruptions": _interruptions(), "synthesis": _synthesis()}


def _own(sentences: int) -> dict[str, Any]:
    """Have the robot talk to itself, and count what it takes for a person's words."""
    with _room() as room:
        cpu_s, began_s, interrupted = time.process_time(), room.now_s, 0
        for number in range(sentences):
            ended = room.robot_says(SENTENCES[number % len(SENTENCES)])
            interrupted += ended is None or ended.event != "finished"
            room.run(1.0)
        return {
            "sentences": sentences,
            "interrupted_itself": interrupted,
            "phrases_of_its_own": len(room.heard()),
            "cpu_ratio": round((time.process_time() - cpu_s) / (room.now_s - began_s), 3),
        }


def _interruptions() -> dict[str, Any]:
    took_s: list[float] = []
    tried = 0
    for taught in (1, len(SENTENCES)):
        for voice, text in PEOPLE:
            for after_s in AFTER_S:
                tried += 1
                took_s.extend(_interrupt(taught, voice, text, after_s))
    return {
        "tried": tried,
        "noticed": len(took_s),
        "within_half_a_second": sum(one <= 0.5 for one in took_s),
        "p50_s": round(statistics.median(took_s), 2) if took_s else None,
        "worst_s": round(max(took_s), 2) if took_s else None,
    }


def _interrupt(taught: int, voice: str, text: str, after_s: float) -> Iterator[float]:
    """Yield the time from the first sound of a person until the voice falls silent, if it does."""
    with _room() as room:
        for sentence in SENTENCES[:taught]:
            room.robot_says(sentence)
            room.run(0.5)
        say_id = room.announcer.say(LONG)
        room.run(after_s)
        began_s = room.now_s
        room.person_says(text, Talker(engine=EspeakEngine(voice=voice)))
        ended = room.end_of(say_id, PATIENCE_S)
        if ended is not None and ended.event == "interrupted":
            yield room.now_s - began_s


def _synthesis() -> dict[str, Any]:
    """Time how long the first sound of a sentence is waited for."""
    engine, took_s = EspeakEngine(), []
    for sentence in SENTENCES * 4:
        began_s = time.perf_counter()
        engine.synthesise(sentence)
        took_s.append(time.perf_counter() - began_s)
    return {"voice": engine.voice, "p50_s": round(statistics.median(took_s), 3)}


@contextmanager
def _room() -> Iterator[SpeechRoom]:
    with tempfile.TemporaryDirectory(prefix="vla-voice-") as folder:
        room = SpeechRoom(Path(folder))
        try:
            yield room
        finally:
            room.close()


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech_voice", __doc__)
    arguments.add_argument("--sentences", type=int, default=12, help="that the robot says alone")
    given = arguments.parse_args(argv)
    show(measure(given.sentences), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
