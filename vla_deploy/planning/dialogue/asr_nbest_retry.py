"""Plan what may have been said instead, where the words as they were recognised make no sense.

A recogniser that is unsure has several readings; the first with a plan is read back before anything
moves. The words themselves are tried without their commas first, which may be pauses only.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from drivers.clock import Clock
from vla_deploy.planning.dialogue.command import READ_BACK, PlannedCommand, UserCommand
from vla_deploy.runtime.deadline import Deadline

PATIENCE_S: Final = 1.0
"""So long other readings are tried."""
_MARKS: Final = re.compile(r"[,;:.]+(?= |$)")


class NBestRetry:
    """Remember of one command how it was recognised first, and until when others are tried."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._first: PlannedCommand | None = None
        self._patience = Deadline.within(clock, 0.0)

    def within_s(self, command: UserCommand, usual_s: float) -> float:
        """Return how long planning a reading may take; all others share what patience is left."""
        return self._patience.left_s if self._first_of(command) is not None else usual_s

    def next(self, done: PlannedCommand) -> UserCommand | PlannedCommand:
        """Return the command in the next words to try, or what is to be concluded.

        Of readings without a plan the first is concluded.
        """
        command, first = done.command, self._first_of(done.command)
        makes_sense = done.answer.is_final if first is None else done.answer.plan is not None
        if makes_sense or not command.is_spoken or command.recovers:
            self._first = None
            return done
        if first is None:
            first = self._first = done
            self._patience = Deadline.within(self._clock, PATIENCE_S)
            command = replace(command, others=tuple(_readings(command)))
        if command.others and self._patience.left_s > 0.0:
            return _in_other_words(command, first.command)
        self._first = None
        return first

    def _first_of(self, command: UserCommand) -> PlannedCommand | None:
        first = self._first
        same = first is not None and first.command.command_id == command.command_id
        return first if same else None


def _readings(command: UserCommand) -> Iterator[tuple[str, float]]:
    """Yield the words of a command alone, then what else may have been said."""
    bare = _MARKS.sub("", command.text)
    if bare != command.text.strip(" ,;:."):
        yield bare, 1.0
    yield from command.others


def _in_other_words(command: UserCommand, first: UserCommand) -> UserCommand:
    """Return a command in the next of its other readings, as sure as that is."""
    (text, odds), *rest = command.others
    sure = first.heard_confidence
    if text != _MARKS.sub("", first.text):
        sure = min(READ_BACK, odds * (1.0 if sure is None else sure))
    return replace(command, text=text, others=tuple(rest), heard_confidence=sure)
