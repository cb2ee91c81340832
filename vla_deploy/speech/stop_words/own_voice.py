"""Tell the robot's own words from a person's: it must hear "stop" while it speaks, too.

The rule, from when the robot begins to speak until its sound has died away:

- A word counts from the threshold `own_voice` on, which is higher.
- A stop word that the spoken text itself holds is expected as often as it is there: so many times
  it is taken for the robot's own, and counted as that. The next time it is a person's.
- A form of such a word, as in "I have stopped", is no stop word and takes nothing off.
"""

import re
from collections import Counter
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.speech.companions import Playing

TAIL_NS: Final = NS_PER_S // 2
_WORD: Final = re.compile(r"[a-z]+")


class OwnVoice:
    """Follow what the robot says."""

    def __init__(self) -> None:
        self._say_id: str | None = None
        self._until_ns = 0
        self._expected: Counter[str] = Counter()

    def follow(self, playing: Playing | None, now_ns: int) -> None:
        """Take what the speaker plays at this moment."""
        if playing is None:
            return
        self._until_ns = now_ns + TAIL_NS
        if playing.say_id != self._say_id:
            self._say_id = playing.say_id
            self._expected = Counter(_WORD.findall(playing.text.lower()))

    def sounds(self, stamp_ns: int) -> bool:
        """Tell whether the robot may be heard at this moment."""
        return stamp_ns < self._until_ns

    def takes(self, word: str, stamp_ns: int) -> bool:
        """Tell whether a word heard at this moment is the robot's own, and take it off."""
        if not self.sounds(stamp_ns) or not self._expected[word]:
            return False
        self._expected[word] -= 1
        return True
