"""Plan what may have been said instead, where the words as they were recognised make no sense.

A recogniser that is unsure has several readings; the one with a plan in this room and this moment
is the likeliest. It is read back before anything moves. Each is tried without its commas, too,
which may be pauses only. A plan about things that have not been seen gives way to one about things
that are there, and what a model makes of unsure words to words that a pattern covers.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from drivers.clock import Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.builders.steps import is_seen
from vla_deploy.planning.command_parser.rung import NAME as COMMAND_PARSER
from vla_deploy.planning.dialogue.command import READ_BACK, PlannedCommand, UserCommand
from vla_deploy.planning.patterns.steering import awaiting

PATIENCE_S: Final = 1.0
"""So long other readings are given to back ends that take time, too."""
WELL_HEARD: Final = 0.75
LEAST_INSTEAD: Final = 0.15
"""Words heard less surely give way to others that make more sense, if those are so likely."""
_MARKS: Final = re.compile(r"[,;:.]+(?= |$)")


class NBestRetry:
    """Remember of one command how it was recognised first, and since when others are tried."""

    def __init__(self, clock: Clock) -> None:
        self._first: PlannedCommand | None = None
        self._clock = clock
        self._patience = Deadline.within(clock, 0.0)

    def is_urgent(self, command: UserCommand) -> bool:
        """Return whether a reading may only be given to back ends that answer at once."""
        return self._first_of(command) is not None and self._patience.left_s <= 0.0

    def within_s(self, command: UserCommand, usual_s: float) -> float:
        """Return how long planning a reading may take; all others share what patience is left."""
        left_s = self._patience.left_s
        return min(usual_s, left_s) if self._first_of(command) and left_s > 0.0 else usual_s

    def forget(self) -> None:
        """Forget the command: it is given up."""
        self._first = None

    def next(self, done: PlannedCommand) -> UserCommand | PlannedCommand:
        """Return the command in the next words to try, or what is to be concluded.

        Of readings without a plan the first is concluded.
        """
        first = self._first_of(done.command)
        gives_way = _gives_way(done)
        other = self._other_reading(done, first, gives_way=gives_way)
        if other is not None:
            return other
        self._first = None
        has_plan = done.answer.plan is not None and not gives_way
        return done if first is None or has_plan else first

    def _other_reading(
        self, done: PlannedCommand, first: PlannedCommand | None, *, gives_way: bool
    ) -> UserCommand | None:
        command = done.command
        if not command.is_spoken or command.recovers:
            return None
        makes_sense = done.answer.is_final if first is None else done.answer.plan is not None
        sure = command.heard_confidence
        if makes_sense and not (gives_way and sure is not None and sure < WELL_HEARD):
            return None
        if first is None:
            first = self._first = done
            self._patience = Deadline.within(self._clock, PATIENCE_S)
            least = LEAST_INSTEAD if makes_sense else 0.0
            readings = (one for one in _readings(command) if one[1] >= least)
            command = replace(command, others=tuple(readings))
        return _in_other_words(command, first.command)

    def _first_of(self, command: UserCommand) -> PlannedCommand | None:
        first = self._first
        same = first is not None and first.command.command_id == command.command_id
        return first if same else None


def _gives_way(done: PlannedCommand) -> bool:
    """Return whether other words may make more sense: of things that are there, or to a pattern.

    The command parser and language models make something of misheard words, too.
    """
    proposal, plan, scene = done.answer.proposal, done.answer.plan, done.request.scene
    if proposal is not None and (proposal.knows_grammar or proposal.back_end == COMMAND_PARSER):
        return True
    if plan is None or scene is None or not scene.things:
        return False
    sought = [one.parameters["object"] for one in plan.actions if one.skill == "find_object"]
    return not all(is_seen(str(text), done.request) for text in sought)


def _readings(command: UserCommand) -> Iterator[tuple[str, float]]:
    """Yield all other readings of a command, and of each its words alone."""
    tried = {_spoken(command.text)}
    for text, odds in ((command.text, 1.0), *command.others):
        for reading in (text, _bare(text)):
            if _spoken(reading) not in tried:
                tried.add(_spoken(reading))
                yield reading, odds


def _bare(text: str) -> str:
    """Return the words of a text alone."""
    return _MARKS.sub("", text)


def _spoken(text: str) -> str:
    """Return what two texts have in common where no difference can be heard."""
    return text.lower().strip(" ,;:.!?")


def _in_other_words(command: UserCommand, first: UserCommand) -> UserCommand | None:
    """Return a command in the next of its other readings, as sure as that is."""
    if not command.others:
        return None
    (text, odds), *rest = command.others
    sure = first.heard_confidence
    if text != _bare(first.text):
        sure = min(READ_BACK, odds * (1.0 if sure is None else sure))
    bare = awaiting(text)
    return replace(
        command,
        text=text if bare is None else bare,
        others=tuple(rest),
        heard_confidence=sure,
        awaits_word=command.awaits_word or bare is not None,
    )
