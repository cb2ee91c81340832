"""Listen for stop words on the raw stream, and press the stop button the moment one is heard.

The robot must hear "stop" while it speaks, too, and not from itself. So from when it begins to
speak until its sound has died away, a stop word that the spoken text itself holds is expected as
often as it is there: so many times it is taken for the robot's own. The next time it is a person's.
A form of such a word, as in "I have stopped", is no stop word and takes nothing off.
"""

import logging
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from platforms import Profile, SpeechSettings
from vla_deploy.inference.errors import InferenceError, RunFailed
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.stop_button import StopButton
from vla_deploy.node import NodeContext
from vla_deploy.speech.errors import SpeechError
from vla_deploy.speech.sound import Playing, SoundBlock
from vla_deploy.speech.stop_words.spotter import Spotted, Spotter, open_spotter
from vla_deploy.speech.voice.robot_voice import RobotVoice
from vla_deploy.speech.words import words_of

OFF: Final = "off"
OFF_WHY: Final = "switched off by the profile: speech.stop_words"
KEPT: Final = 8
OVERLAP_NS: Final = NS_PER_S // 2
"""A phrase that ends so long before a word was settled may still have held it."""
TAIL_NS: Final = NS_PER_S // 2
"""For so long what the robot has said may still be heard."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ListeningPlace:
    """Name where a listener listens: in `speech_status`, as a source of stops, and in the log."""

    name: str
    source: str
    how: str


ROOM: Final = ListeningPlace(name="stop_words", source="voice", how="by voice")
PAGE: Final = ListeningPlace(
    name="page_stop_words", source="page_voice", how="by voice into the page"
)


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
        open_spotter: Callable[[], Spotter],
        settings: SpeechSettings,
        clock: Clock,
        playing: Callable[[], Playing | None] = lambda: None,
        place: ListeningPlace = ROOM,
    ) -> None:
        """Take how the network is opened, which of its thresholds holds, what the robot says."""
        self.name = place.name
        self._place = place
        self._open_spotter = open_spotter
        self._sensitivity = settings.stop_words
        self._clock = clock
        self._playing = playing
        self._say_id = ""
        self._expected: Counter[str] = Counter()
        self._sounds_until_ns = 0
        self._spotter: Spotter | None = None
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
        """Open button and network; why it cannot be opened is told, and the robot goes on."""
        self._button = StopButton(space, self._place.source, self._clock)
        self._heard = space.ring_writer("heard")
        try:
            self._spotter = self._open_spotter()
        except (InferenceError, SpeechError) as error:
            self._break(str(error))
        self._warn_if_off()

    def adopt(self, settings: SpeechSettings) -> None:
        """Go by the sensitivity of another profile from now on."""
        changed, self._sensitivity = self._sensitivity != settings.stop_words, settings.stop_words
        if changed:
            self._warn_if_off()

    def feed(self, block: SoundBlock) -> None:
        """Take the next block, and press the button where a stop word was heard in it.

        It runs within the node's step and takes a small part of it.
        """
        self._follow_own_voice()
        spotter = self._spotter
        if spotter is None or self._sensitivity == OFF:
            return
        if not block.follows:
            spotter.reset()
        runs = spotter.runs
        try:
            threshold = spotter.thresholds[self._sensitivity]
            spotted = spotter.feed(block.samples, block.end_ns, threshold)
        except RunFailed as error:
            self._counts["failed_runs"] += 1
            self._break(str(error))
            return
        if spotter.runs > runs:
            self._broken = ""
        if spotted is not None and self._is_own(spotted):
            self._counts["own_voice"] += 1
        elif spotted is not None:
            self._press(spotted)

    def refuses(self, began_ns: int, ended_ns: int) -> str:
        """Return that a stop word was heard in a phrase of that time, if so: it is no command."""
        for spotted in self._pressed:
            if began_ns <= spotted.stamp_ns <= ended_ns + OVERLAP_NS:
                return f"{spotted.word!r} was heard in it: the robot has stopped"
        return ""

    def document(self) -> Mapping[str, Any]:
        """Return what `speech_status` tells under the listener's name."""
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

    def _follow_own_voice(self) -> None:
        playing = self._playing()
        if playing is None:
            return
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
        self._counts["spotted"] += 1
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
            _log.error("degraded: nobody can stop the robot %s: %s", self._place.how, why)
        self._broken = why

    def _warn_if_off(self) -> None:
        if self._sensitivity == OFF:
            _log.warning("degraded: nobody can stop the robot %s: %s", self._place.how, OFF_WHY)


def build_stop_words(
    context: NodeContext,
    profile: Profile,
    voice: RobotVoice | None = None,
    place: ListeningPlace = ROOM,
) -> StopWords:
    """Return the listener to a place; it opens the profile's network when the node starts."""
    # It claims no memory: what hears a spoken stop is never refused for want of it.
    shelf = ModelShelf.of_base(context.run_dir.parent, context.clock)
    return StopWords(
        lambda: open_spotter(shelf, profile),
        profile.speech,
        context.clock,
        lambda: None if voice is None else voice.playing,
        place,
    )
