"""Listen for stop words on the raw stream, and press the stop button the moment one is heard."""

import logging
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from platforms import SpeechSettings
from vla_deploy.inference.errors import InferenceError, RunFailed
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.speech.companions import Playing
from vla_deploy.speech.sound import SoundBlock
from vla_deploy.speech.stop_words.errors import StopWordsError
from vla_deploy.speech.stop_words.own_voice import OwnVoice
from vla_deploy.speech.stop_words.spotter import Spotted, Spotter
from vla_deploy.speech.stop_words.suspicions import Suspicions, alone

OFF: Final = "off"
OFF_WHY: Final = "switched off by the profile: speech.stop_words"
KEPT: Final = 8
OVERLAP_NS: Final = NS_PER_S // 2
"""A phrase that ends so long before a word was settled may still have held it."""
_log = logging.getLogger(__name__)

OpenSpotter = Callable[[], tuple[Spotter, Mapping[str, float]]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ear:
    """Name where a listener listens: in `speech_status`, as a source of stops, and in the log."""

    name: str
    source: str
    how: str


ROOM: Final = Ear(name="stop_words", source="voice", how="by voice")
PAGE: Final = Ear(name="page_stop_words", source="page_voice", how="by voice into the page")


class State(StrEnum):
    """Say whether a spoken stop is heard."""

    LIVE = "live"
    OFF = "off"
    BROKEN = "broken"


class StopWords:
    """Listen to one stream: it needs no end of phrase, no recogniser and no planner.

    While it is off or broken it says so in the log, in `speech_status` and to `doctor`: a robot
    whose spoken stop is dead looks like one that nobody has spoken to.
    """

    def __init__(
        self,
        open_spotter: OpenSpotter,
        settings: SpeechSettings,
        clock: Clock,
        playing: Callable[[], Playing | None] = lambda: None,
        ear: Ear = ROOM,
    ) -> None:
        """Take how the model is opened, which of its thresholds holds, and what the robot says."""
        self.name = ear.name
        self._ear = ear
        self._open_spotter = open_spotter
        self._sensitivity = settings.stop_words
        self._clock = clock
        self._playing = playing
        self._own = OwnVoice()
        self._suspicions = Suspicions()
        self._spotter: Spotter | None = None
        self._thresholds: Mapping[str, float] = {}
        self._pressed: deque[Spotted] = deque(maxlen=KEPT)
        self._counts = {"spotted": 0, "own_voice": 0, "failed_runs": 0}
        self._broken = ""

    @property
    def state(self) -> State:
        """Return whether a spoken stop is heard."""
        if self._sensitivity == OFF:
            return State.OFF
        return State.BROKEN if self._broken else State.LIVE

    def start(self, space: SharedSpace) -> None:
        """Open button and model; why it cannot be opened is told, and the robot goes on."""
        self._button = StopButton(space, self._ear.source, self._clock)
        self._heard = space.ring_writer("heard")
        try:
            self._spotter, self._thresholds = self._open_spotter()
        except (InferenceError, StopWordsError) as error:
            self._break(str(error))
        self._warn_if_off()

    def heed(self, settings: SpeechSettings) -> None:
        """Go by the sensitivity of another profile from now on."""
        changed, self._sensitivity = self._sensitivity != settings.stop_words, settings.stop_words
        if changed:
            self._warn_if_off()

    def feed(self, block: SoundBlock, *, is_read: bool) -> None:
        """Take the next block, and press the button where a stop word was heard in it.

        `is_read` tells that the recogniser reads it too: then a word alone must be clear.
        """
        self._own.follow(self._playing(), self._clock.now_ns())
        if self._spotter is None or self._sensitivity == OFF:
            return
        if not block.follows:
            self._spotter.reset()
            self._suspicions.clear()
        own = self._own.sounds(block.end_ns)
        sensitivity = "own_voice" if own else self._sensitivity
        threshold = self._thresholds[sensitivity]
        runs = self._spotter.runs
        try:
            enough = alone(sensitivity, threshold) if is_read else threshold
            spotted = self._spotter.feed(block.samples, block.end_ns, enough)
        except RunFailed as error:
            self._counts["failed_runs"] += 1
            self._break(str(error))
            return
        if self._spotter.runs > runs:
            self._broken = ""
        if not own and self._spotter.runs > runs:
            self._suspicions.note(block.end_ns, self._spotter.score, threshold)
        if spotted is not None:
            self._take(spotted)

    def refuses(self, began_ns: int, ended_ns: int) -> str:
        """Return that a stop word was heard in a phrase of that time, if so: it is no command."""
        for spotted in self._pressed:
            if began_ns <= spotted.stamp_ns <= ended_ns + OVERLAP_NS:
                return f"{spotted.word!r} was heard in it: the robot has stopped"
        return ""

    def suspicion(self, began_ns: int, ended_ns: int) -> float:
        """Return how near its threshold a stop word came in what was said from then to then."""
        return 0.0 if self.state is not State.LIVE else self._suspicions.highest(began_ns, ended_ns)

    def document(self) -> Mapping[str, Any]:
        """Return what `speech_status` tells under "stop_words"."""
        newest = self._pressed[-1] if self._pressed else None
        return {
            "state": self.state,
            "why": OFF_WHY if self._sensitivity == OFF else self._broken,
            "sensitivity": self._sensitivity,
            "words": [] if self._spotter is None else list(self._spotter.words),
            **self._counts,
            "newest": None if newest is None else asdict(newest),
        }

    def close(self) -> None:
        """Release button and topic; closing twice is allowed."""
        self._button.close()
        self._heard.close()

    def _take(self, spotted: Spotted) -> None:
        if self._own.takes(spotted.word, spotted.stamp_ns):
            self._counts["own_voice"] += 1
            return
        self._button.press(f"heard {spotted.word!r}")
        self._counts["spotted"] += 1
        self._pressed.append(spotted)
        now_ns = self._clock.now_ns()
        self._heard.publish(
            {
                "text": spotted.word,
                "confidence": round(spotted.score, 3),
                "verdict": "stop",
                "reason": "a stop word on the stream",
                "began_ns": spotted.stamp_ns,
                "ended_ns": spotted.stamp_ns,
                "told_ns": now_ns,
            }
        )
        _log.warning("stopped: heard %r, score %.2f", spotted.word, spotted.score)

    def _break(self, why: str) -> None:
        if not self._broken:
            _log.error("degraded: nobody can stop the robot %s: %s", self._ear.how, why)
        self._broken = why

    def _warn_if_off(self) -> None:
        if self._sensitivity == OFF:
            _log.warning("degraded: nobody can stop the robot %s: %s", self._ear.how, OFF_WHY)
