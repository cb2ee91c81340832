"""Listen for stop words on the raw stream, and press the stop button the moment one is heard.

The robot must hear "stop" while it speaks, too, and not from itself. So from when it begins to
speak until its sound has died away, a stop word that the spoken text itself holds is expected as
often as it is there: so many times it is taken for the robot's own. The next time it is a person's.
A form of such a word, as in "I have stopped", is no stop word and takes nothing off.
"""

import logging
from collections import Counter, deque
from collections.abc import Callable
from enum import StrEnum
from typing import Final

from drivers.clock import NS_PER_S, Clock
from platforms import Profile, SpeechSettings
from vla_deploy.inference.errors import InferenceError, RunFailed
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.speech import StopWordsStatus
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.runtime.node import NodeContext
from vla_deploy.speech.sound import Playing, SoundBlock
from vla_deploy.speech.stop_words.spotter import Spotted, Spotter, open_spotter
from vla_deploy.speech.words import words_of

ROOM: Final = ""
PAGE: Final = "page_"
"""Where a listener listens, as its names begin."""
OFF: Final = "off"
OFF_WHY: Final = "switched off by the profile: speech.stop_words"
KEPT: Final = 8
OVERLAP_NS: Final = NS_PER_S // 2
"""A phrase that ends so long before a word was settled may still have held it."""
TAIL_NS: Final = NS_PER_S // 2
"""For so long what the robot has said may still be heard."""
_log = logging.getLogger(__name__)


class StopState(StrEnum):
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
        open_spotter: Callable[[], Spotter],
        settings: SpeechSettings,
        clock: Clock,
        place: str = ROOM,
    ) -> None:
        """Take how the network is opened, and which of its thresholds holds."""
        self.name, self._source = f"{place}stop_words", f"{place}voice"
        self._open_spotter = open_spotter
        self._sensitivity = settings.stop_words
        self._clock = clock
        self._say_id = ""
        self._expected: Counter[str] = Counter()
        self._sounds_until_ns = 0
        self._spotter: Spotter | None = None
        self._pressed: deque[Spotted] = deque(maxlen=KEPT)
        self._broken = ""

    @property
    def state(self) -> StopState:
        """Return whether a spoken stop is heard."""
        if self._sensitivity == OFF:
            return StopState.OFF
        return StopState.BROKEN if self._broken else StopState.LIVE

    def start(self, space: SharedSpace) -> None:
        """Open button and network; why it cannot be opened is told, and the robot goes on."""
        self._button = StopButton(space, self._source, self._clock)
        self._heard = space.ring_writer(topics.HEARD)
        try:
            self._spotter = self._open_spotter()
        except InferenceError as error:
            self._break(str(error))
        self._warn_if_off()

    def adopt(self, settings: SpeechSettings) -> None:
        """Go by the sensitivity of another profile from now on."""
        self._sensitivity = settings.stop_words
        self._warn_if_off()

    def feed(self, frame: SoundBlock, playing: Playing | None = None) -> None:
        """Take the next frame, and press the button where a stop word was heard in it.

        `playing` is what the robot says there. It runs within the node's step and takes a small
        part of it.
        """
        if playing is not None:
            self._follow_own_voice(playing)
        spotter = self._spotter
        if spotter is None or self._sensitivity == OFF:
            return
        if not frame.follows:
            spotter.reset()
        runs = spotter.runs
        try:
            threshold = spotter.thresholds[self._sensitivity]
            spotted = spotter.feed(frame.samples, frame.end_ns, threshold)
        except RunFailed as error:
            self._break(str(error))
            return
        if spotter.runs > runs:
            self._broken = ""
        if spotted is not None and not self._is_own(spotted):
            self._press(spotted)

    def refuses(self, began_ns: int, ended_ns: int) -> str:
        """Return that a stop word was heard in a phrase of that time, if so: it is no command."""
        for spotted in self._pressed:
            if began_ns <= spotted.stamp_ns <= ended_ns + OVERLAP_NS:
                return f"{spotted.word!r} was heard in it: the robot has stopped"
        return ""

    def document(self) -> StopWordsStatus:
        """Return what `speech_status` tells under the listener's name."""
        return {
            "state": self.state,
            "why": OFF_WHY if self._sensitivity == OFF else self._broken,
            "sensitivity": self._sensitivity,
        }

    def close(self) -> None:
        """Release button and topic; closing twice is allowed."""
        self._button.close()
        self._heard.close()

    def _follow_own_voice(self, playing: Playing) -> None:
        self._sounds_until_ns = self._clock.now_ns() + TAIL_NS
        if playing.say_id != self._say_id:
            self._say_id = playing.say_id
            self._expected = Counter(words_of(playing.text))

    def _is_own(self, spotted: Spotted) -> bool:
        """Return whether the robot says this word itself now, and expect it once less."""
        if spotted.stamp_ns >= self._sounds_until_ns or not self._expected[spotted.word]:
            return False
        self._expected[spotted.word] -= 1
        return True

    def _press(self, spotted: Spotted) -> None:
        self._button.press(f"heard {spotted.word!r}")
        self._pressed.append(spotted)
        self._heard.publish(
            {
                "text": spotted.word,
                "confidence": round(spotted.score, 3),
                "verdict": "stop",
                "reason": "a stop word on the stream",
                "began_ns": spotted.stamp_ns,
                "ended_ns": spotted.stamp_ns,
                "told_ns": self._clock.now_ns(),
            }
        )
        _log.warning("stopped: heard %r, score %.2f", spotted.word, spotted.score)

    def _break(self, why: str) -> None:
        if not self._broken:
            _log.error("degraded: nobody can stop the robot by %s: %s", self._source, why)
        self._broken = why

    def _warn_if_off(self) -> None:
        if self._sensitivity == OFF:
            _log.warning("degraded: nobody can stop the robot by %s: %s", self._source, OFF_WHY)


def build_stop_words(context: NodeContext, profile: Profile, place: str = ROOM) -> StopWords:
    """Return the listener to a place; it opens the profile's network when the node starts."""
    # It claims no memory: what hears a spoken stop is never refused for want of it.
    shelf = ModelShelf.of_base(context.run_dir.parent, context.clock)
    return StopWords(lambda: open_spotter(shelf, profile), profile.speech, context.clock, place)
