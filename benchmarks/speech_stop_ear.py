"""Run what listens for a stop on board, spotter and recogniser, over whole pieces of sound."""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from benchmarks.percentiles import percentile, spread_s
from benchmarks.speech_stop_recall import Glances, Recall, RecallingReader
from drivers.clock import MonotonicClock
from platforms import load_profile
from training.voices.clip import RATE_HZ, Wave
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.speech.choosing import ears_of
from vla_deploy.speech.hearing import Room
from vla_deploy.speech.recording import StreamClock, open_hearing
from vla_deploy.speech.sound import SoundBlock, duration_ns
from vla_deploy.speech.stop_words.opening import open_spotter
from vla_deploy.speech.stop_words.spotter import Spotted, Spotter
from vla_deploy.speech.stop_words.suspicions import Suspicions, alone
from vla_deploy.speech.verdict import Verdict
from vla_deploy.state_dir import user_base

BLOCK: Final = RATE_HZ // 50
"""The node steps so often."""
SPOTTER, WORDS = "spotter", "words"


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Tell a word and who heard it, when the button is hit, and what the last block took."""

    word: str
    by: str
    at_s: float
    computed_s: float


class Delay(NamedTuple):
    """Tell how much had been heard since the word's end, and what the computer took for it."""

    sound_s: float
    computed_s: float


def delay_figures(delays: Sequence[Delay]) -> dict[str, float | None]:
    """Return the delays' spread, and what would be left of it on a computer that takes no time."""
    return {
        **spread_s("stop_delay", [sum(delay) for delay in delays]),
        "stop_delay_sound_p95_s": percentile([delay.sound_s for delay in delays], 95),
    }


class Ear:
    """Run over whole pieces of sound what listens on board."""

    def __init__(self, recall: Recall, glances: Glances) -> None:
        profile = load_profile("desktop")
        shelf = ModelShelf.of_base(user_base(), MonotonicClock())
        self.spotter: Spotter
        self.spotter, thresholds = open_spotter(shelf, profile)
        self.threshold = thresholds[profile.speech.stop_words]
        self._alone = alone(profile.speech.stop_words, self.threshold)
        self._clock = StreamClock()
        ears = ears_of(shelf, profile, 0)
        self.why_no_words = ears.why
        lately_ns = ears.recogniser.lately_ns if ears.recogniser is not None else deque[int]()
        self._reader = RecallingReader(lately_ns, recall, glances)
        self._suspicions = Suspicions()
        self._hearing = open_hearing(
            ears.recogniser,
            ears.why,
            profile,
            self._clock,
            suspicion=self._suspicions.highest,
            executor=self._reader,
        )
        self._count = 0
        self.busy_s = {SPOTTER: 0.0, WORDS: 0.0}

    @property
    def heard_s(self) -> float:
        """Return how much was heard."""
        return self._count / RATE_HZ

    def alarms(self, sound: Wave) -> Iterator[Alarm]:
        """Yield what a piece of sound sets off, heard from silence on."""
        self.spotter.reset()
        self._suspicions.clear()
        self._hearing.enter(Room())
        for at in range(0, len(sound), BLOCK):
            samples = sound[at : at + BLOCK]
            block = SoundBlock(stamp_ns=duration_ns(self._count), samples=samples, follows=at > 0)
            self._count += len(samples)
            self._clock.ns = block.end_ns
            for by, listen in ((SPOTTER, self._spot), (WORDS, self._read)):
                began_s, busy_s = time.perf_counter(), time.process_time()
                word = listen(block)
                recalled_s = self._reader.recalled_s()
                took_s = time.perf_counter() - began_s + recalled_s
                self.busy_s[by] += time.process_time() - busy_s + recalled_s
                if word:
                    at_s = (at + len(samples)) / RATE_HZ
                    yield Alarm(word=word, by=by, at_s=at_s, computed_s=took_s)

    def _spot(self, block: SoundBlock) -> str:
        spotted: Spotted | None = self.spotter.feed(block.samples, block.end_ns, self._alone)
        self._suspicions.note(block.end_ns, self.spotter.score, self.threshold)
        return "" if spotted is None else spotted.word

    def _read(self, block: SoundBlock) -> str:
        self._hearing.feed(block, None)
        told = list(self._hearing.heard())
        return next((one.text for one in told if one.judgement.verdict is Verdict.STOP), "")
