"""Keep the robot from hearing itself, and let a person speak into what it says.

The rule, while the robot speaks and until its sound has died away:

- A frame counts as a person's only if the voice network is sure of it, and if it is louder than the
  robot's own voice may be at the microphone once its echo is taken out. Everything else is dropped.
- Enough such frames within a short time are a person who barges in: the voice falls silent, and
  from then on everything is heard until the robot speaks again.
- What still comes through may be the robot's own words: in a phrase that began while it sounded,
  with nobody barging in, and that ended with that sound. A person who answers quickly goes on.
- The keyword network for stops is not touched by any of this.
"""

from collections import deque
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.sound import Playing

SURE: Final = 0.8
BARGE_FRAMES: Final = 6
WITHIN_FRAMES: Final = 10
OUTLASTS_NS: Final = 3 * NS_PER_S // 10
"""A voice that goes on for so long after the robot's sound has died away is a person's."""


class EchoGate:
    """Follow what the speaker plays, and judge each frame of the microphone by it."""

    def __init__(self) -> None:
        self._playing: Playing | None = None
        self._until_ns = 0
        self._persons: deque[bool] = deque(maxlen=WITHIN_FRAMES)
        self._opened = False
        self._own_words = ""

    @property
    def is_shut(self) -> bool:
        """Return whether the robot can be heard at this moment, and nobody has barged in."""
        return self._playing is not None and not self._opened

    def follow(self, playing: Playing | None, end_ns: int) -> None:
        """Take what sounds, the room's answer included, during the frame that ends at `end_ns`."""
        self._playing = playing
        if playing is None:
            self._opened = False
            self._persons.clear()
        else:
            self._until_ns = end_ns

    def is_person(self, level_db: float, voice: float) -> bool:
        """Judge one frame of the microphone while the gate is shut."""
        loudest_db = level_db if self._playing is None else self._playing.echo_db
        is_person = voice >= SURE and level_db >= loudest_db
        self._persons.append(is_person)
        return is_person

    def barges_in(self) -> bool:
        """Return, once, that a person speaks into what the robot says, and open the gate."""
        if sum(self._persons) < BARGE_FRAMES:
            return False
        self._opened = True
        self._persons.clear()
        self._own_words = ""
        return True

    def note_begun(self) -> None:
        """Note that a phrase begins."""
        playing = None if self._opened else self._playing
        self._own_words = "" if playing is None else playing.text

    def own_words(self, phrase: Phrase) -> str:
        """Return what the robot was saying in a phrase that pauses or ends; mostly nothing."""
        outlasts = phrase.ended_ns > self._until_ns + OUTLASTS_NS
        return "" if outlasts else self._own_words
