"""Run what listens for a stop on board, spotter and recogniser, over whole pieces of sound."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from benchmarks.percentiles import percentile, spread_s
from drivers.clock import MonotonicClock
from platforms import load_profile
from training.voices.clip import RATE_HZ, Wave
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.runtime.state_dir import user_base
from vla_deploy.speech.model_selection import select_recogniser
from vla_deploy.speech.recording import StreamClock, frames_of, open_hearing
from vla_deploy.speech.sound import FRAME, FRAME_S, SoundBlock
from vla_deploy.speech.stop_words.spotter import Spotted, open_spotter
from vla_deploy.speech.verdict import PhraseVerdict

SPOTTER, WORDS = "spotter", "words"


@dataclass(frozen=True, slots=True, kw_only=True)
class StopAlarm:
    """Hold a word and who heard it, when the button is hit, and what the last block took."""

    word: str
    by: str
    at_s: float
    computed_s: float


class Delay(NamedTuple):
    """Hold how much had been heard since the word's end, and what the computer took for it."""

    sound_s: float
    computed_s: float


def delay_figures(delays: Sequence[Delay]) -> dict[str, float | None]:
    """Return the delays' spread, and what would be left of it on a computer that takes no time."""
    return {
        **spread_s("stop_delay", [sum(delay) for delay in delays]),
        "stop_delay_sound_p95_s": percentile([delay.sound_s for delay in delays], 95),
    }


class StopListening:
    """Run over whole pieces of sound what listens on board.

    `scores` are the spotter's in the last piece, each with its time: for the curve of thresholds.
    """

    def __init__(self) -> None:
        profile = load_profile("desktop")
        shelf = ModelShelf.of_base(user_base(), MonotonicClock())
        self.spotter = open_spotter(shelf, profile)
        self.threshold = self.spotter.thresholds[profile.speech.stop_words]
        self._clock = StreamClock()
        selected = select_recogniser(shelf, profile, 0)
        self.why_no_words = selected.why
        self._asr = open_hearing(selected, profile, self._clock)
        self._count = 0
        self.scores: list[tuple[float, float]] = []
        self.busy_s = {SPOTTER: 0.0, WORDS: 0.0}

    @property
    def heard_s(self) -> float:
        """Return how much was heard."""
        return self._count / RATE_HZ

    def alarms(self, sound: Wave) -> Iterator[StopAlarm]:
        """Yield what a piece of sound sets off, heard from silence on."""
        self.spotter.reset()
        self.scores = []
        at_s = 0.0
        for frame in frames_of(sound, self._count):
            self._count += FRAME
            self._clock.ns = frame.end_ns
            at_s += FRAME_S
            for by, listen in ((SPOTTER, self._spot), (WORDS, self._read)):
                began_s, busy_s = time.perf_counter(), time.process_time()
                word = listen(frame)
                took_s = time.perf_counter() - began_s
                self.busy_s[by] += time.process_time() - busy_s
                if word:
                    yield StopAlarm(word=word, by=by, at_s=at_s, computed_s=took_s)
            self.scores.append((at_s, self.spotter.score))

    def _spot(self, frame: SoundBlock) -> str:
        spotted: Spotted | None = self.spotter.feed(frame.samples, frame.end_ns, self.threshold)
        return "" if spotted is None else spotted.word

    def _read(self, frame: SoundBlock) -> str:
        self._asr.feed(frame, None)
        told = list(self._asr.heard())
        return next((one.text for one in told if one.judgement.verdict is PhraseVerdict.STOP), "")
