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
from vla_deploy.speech.sound import Playing, SoundBlock, level_db

SURE: Final = 0.8
BARGE_FRAMES: Final = 6
WITHIN_FRAMES: Final = 10
OUTLASTS_NS: Final = 3 * NS_PER_S // 10
"""A voice that goes on for so long after the robot's sound has died away is a person's."""


class EchoGate:
    """Judge each frame of the microphone by what the speaker plays."""

    def __init__(self) -> None:
        self.barged_in = False
        """Whether a person has spoken into what sounds now, or sounded last."""
        self._playing: Playing | None = None
        self._from_ns = self._until_ns = 0
        self._words = ""
        self._persons: deque[bool] = deque(maxlen=WITHIN_FRAMES)

    def persons_voice(self, frame: SoundBlock, voice: float, playing: Playing | None) -> float:
        """Return how probably a person speaks in a frame; `voice` is the network's word for it.

        `playing` is what sounds during the frame, the room's answer included.
        """
        self._follow(frame, playing)
        if playing is None or self.barged_in:
            return voice
        is_person = voice >= SURE and level_db(frame.samples) >= playing.echo_db
        self._persons.append(is_person)
        self.barged_in = sum(self._persons) >= BARGE_FRAMES
        return voice if is_person else 0.0

    def own_words(self, phrase: Phrase) -> str:
        """Return what the robot was saying in a phrase that pauses or ends; mostly nothing."""
        began_within = self._from_ns <= phrase.began_ns < self._until_ns
        outlasts = phrase.ended_ns > self._until_ns + OUTLASTS_NS
        return self._words if began_within and not outlasts and not self.barged_in else ""

    def _follow(self, frame: SoundBlock, playing: Playing | None) -> None:
        before, self._playing = self._playing, playing
        if playing is None:
            return
        if before is None:
            self._from_ns, self._words, self.barged_in = frame.stamp_ns, "", False
            self._persons.clear()
        if before is None or playing.say_id != before.say_id:
            self._words += f" {playing.text}"
        self._until_ns = frame.end_ns
