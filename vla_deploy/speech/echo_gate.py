"""Keep the robot from hearing itself, and let a person speak into what it says.

The rule, while the robot speaks and until its sound has died away:

- A frame counts as a person's only if the voice network is sure of it, and if it is louder than the
  robot's own voice may be at the microphone. Everything else is dropped.
- The voice tells how loud the robot may be at its microphone, once its echo is taken out. Where it
  cannot, that is learnt while it speaks, and a margin added: quickly when it is less loud than
  thought, slowly when it is louder, since that may be a person.
- Enough such frames within a short time are a person who barges in: the voice is told to fall
  silent, and from then on everything is heard until the robot speaks again.
- The listeners to the raw stream, such as the stop words, are not touched by any of this.
"""

from collections import deque
from typing import Final

from vla_deploy.speech.companions import Playing
from vla_deploy.speech.sound import SILENCE_DB
from vla_deploy.speech.voice_activity import FRAME_S

SURE: Final = 0.8
MARGIN_DB: Final = 6.0
BARGE_FRAMES: Final = 6
WITHIN_FRAMES: Final = 10
START_COUPLING_DB: Final = 0.0
_DELAY_FRAMES: Final = 8
_DOWN_DB_S: Final = 12.0
_UP_DB_S: Final = 1.0
_QUIET_DB: Final = -50.0


class EchoGate:
    """Follow what the speaker plays, and judge each frame of the microphone by it."""

    def __init__(self) -> None:
        self.coupling_db = START_COUPLING_DB
        self._played_db: deque[float] = deque(maxlen=_DELAY_FRAMES)
        self._taken_db: deque[float] = deque(maxlen=_DELAY_FRAMES)
        self._persons: deque[bool] = deque(maxlen=WITHIN_FRAMES)
        self._speaking = False
        self._told_db: float | None = None
        self._opened = False

    @property
    def is_shut(self) -> bool:
        """Tell whether the robot can be heard at this moment, and nobody has barged in."""
        return self._speaking and not self._opened

    @property
    def echo_db(self) -> float:
        """Return how loud the robot's own voice may be at the microphone."""
        if self._told_db is not None:
            return self._told_db
        return max(self._played_db, default=SILENCE_DB) + self.coupling_db + MARGIN_DB

    def follow(self, playing: Playing | None) -> None:
        """Take what sounds, and what of it still hangs in the room, as the next frame is judged."""
        self._played_db.append(SILENCE_DB if playing is None else playing.level_db)
        self._speaking = playing is not None
        self._told_db = None if playing is None else playing.echo_db
        if playing is None:
            self._opened = False
            self._persons.clear()
            self._taken_db.clear()

    def is_person(self, level_db: float, voice: float) -> bool:
        """Judge one frame of the microphone while the gate is shut."""
        self._learn(level_db)
        is_person = voice >= SURE and level_db >= self.echo_db
        self._persons.append(is_person)
        return is_person

    def barges_in(self) -> bool:
        """Tell, once, that a person speaks into what the robot says, and open the gate."""
        if sum(self._persons) < BARGE_FRAMES:
            return False
        self._opened = True
        self._persons.clear()
        return True

    def _learn(self, level_db: float) -> None:
        """Compare what was loudest of late on both sides: words have gaps, and sound takes time."""
        self._taken_db.append(level_db)
        loudest_db = max(self._played_db, default=SILENCE_DB)
        if loudest_db < _QUIET_DB:
            return
        step_db = max(self._taken_db) - loudest_db - self.coupling_db
        self.coupling_db += min(max(step_db, -_DOWN_DB_S * FRAME_S), _UP_DB_S * FRAME_S)
