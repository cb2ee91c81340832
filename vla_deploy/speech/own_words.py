"""Know of a phrase what the robot itself was saying: it must not obey itself, but hear an answer.

A phrase may hold the robot's own words only if

- it began while the robot sounded, its echo included, and nobody had barged in;
- nobody barged in later either: the robot falls silent then, and what follows is a person's;
- it ended with that sound or a little later: a person who answers quickly goes on.

What is said into the page never does: another microphone hears it, and the robot falls silent.
"""

from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.speech.companions import Playing
from vla_deploy.speech.frames import Frame
from vla_deploy.speech.phrases import Phrase

OUTLASTS_NS: Final = 3 * NS_PER_S // 10
"""A voice that goes on for so long after the robot's sound has died away is a person's."""


class OwnWords:
    """Follow what the robot says, frame by frame, and who speaks into it."""

    def __init__(self) -> None:
        self._sounding = ""
        self._until_ns = 0
        self._of_phrase = ""

    def follow(self, frame: Frame, playing: Playing | None) -> None:
        """Take what sounds during a frame."""
        self._sounding = "" if playing is None else playing.text
        if playing is not None:
            self._until_ns = frame.end_ns

    def note_begun(self, *, is_person: bool) -> None:
        """Note that a phrase begins, and whether a person is known to speak."""
        self._of_phrase = "" if is_person else self._sounding

    def note_barged_in(self) -> None:
        """Note that a person speaks: whatever phrase is open is theirs."""
        self._of_phrase = ""

    def within(self, phrase: Phrase) -> str:
        """Return what the robot was saying in the phrase that has just ended; mostly nothing."""
        outlasts = phrase.ended_ns > self._until_ns + OUTLASTS_NS
        return "" if outlasts else self._of_phrase
