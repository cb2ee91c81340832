"""Try what may have been said instead, where the words as they were read make no sense.

A recogniser that is unsure has several readings; the one with a plan in this room and this moment
is the likeliest. It is read back before anything moves. Each is tried without its commas, too: a
pause may be a thought's end, or only a breath. A plan about things that nobody has seen gives way
to one about things that are there, and what the command parser makes of unsure words to other words
that a pattern covers.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from drivers.clock import Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.builders.steps import is_seen
from vla_deploy.planning.command_parser.rung import NAME as COMMAND_PARSER
from vla_deploy.planning.inbox import READ_BACK, Command
from vla_deploy.planning.interfaces import Answer, Request

PATIENCE_S: Final = 1.0
"""So long other readings are given to planners that take time, too."""
WELL_HEARD: Final = 0.75
LEAST_INSTEAD: Final = 0.15
"""Words heard less surely give way to others that make more sense, if those are so likely."""
_MARKS: Final = re.compile(r"[,;:.]+(?= |$)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """Hold a command as it was read first, and what came of it."""

    command: Command
    request: Request
    answer: Answer


class Rehearing:
    """Remember of one command how it was read first, and since when others are tried."""

    def __init__(self, clock: Clock) -> None:
        self._first: Heard | None = None
        self._clock = clock
        self._patience = Deadline.within(clock, 0.0)

    def is_urgent(self, command: Command) -> bool:
        """Tell whether a reading may only be given to planners that answer at once."""
        return self._of(command) is not None and self._patience.left_s <= 0.0

    def within_s(self, command: Command, usual_s: float) -> float:
        """Return how long planning a reading may take; all others share what patience is left."""
        left_s = self._patience.left_s
        return min(usual_s, left_s) if self._of(command) and left_s > 0.0 else usual_s

    def forget(self) -> None:
        """Forget the command: it is given up."""
        self._first = None

    def other(self, command: Command, request: Request, answer: Answer) -> Command | None:
        """Return the command in the next other words to try; None if it is to be concluded."""
        if not command.is_spoken or command.recovers:
            return None
        first = self._of(command)
        makes_sense = answer.is_final if first is None else answer.plan is not None
        gives_way = _is_unsure(command) and _gives_way(answer, request)
        if makes_sense and not gives_way:
            return None
        if first is None:
            first = self._first = Heard(command=command, request=request, answer=answer)
            self._patience = Deadline.within(self._clock, PATIENCE_S)
            least = LEAST_INSTEAD if makes_sense else 0.0
            readings = _readings(command)
            command = replace(command, others=tuple(one for one in readings if one[1] >= least))
        return _in_other_words(command, first.command)

    def concluded(self, command: Command, request: Request, answer: Answer) -> Heard:
        """Return what is to be concluded: of readings without a plan the first."""
        first, self._first = self._of(command), None
        if first is None or (answer.plan is not None and not _gives_way(answer, request)):
            return Heard(command=command, request=request, answer=answer)
        return first

    def _of(self, command: Command) -> Heard | None:
        first = self._first
        same = first is not None and first.command.command_id == command.command_id
        return first if same else None


def _gives_way(answer: Answer, request: Request) -> bool:
    """Tell whether other words may make more sense: of things that are there, or to a pattern.

    The command parser makes something of misheard words, too.
    """
    is_parsed = answer.proposal is not None and answer.proposal.rung == COMMAND_PARSER
    return is_parsed or _seeks_unseen(answer, request)


def _seeks_unseen(answer: Answer, request: Request) -> bool:
    """Tell whether a plan looks for a kind of thing that has not been seen, in a known scene."""
    scene = request.scene
    if answer.plan is None or scene is None or not scene.things:
        return False
    sought = [one.parameters["object"] for one in answer.plan.actions if one.skill == "find_object"]
    return not all(is_seen(str(text), request) for text in sought)


def _is_unsure(command: Command) -> bool:
    sure = command.heard_confidence
    return sure is not None and sure < WELL_HEARD


def _readings(command: Command) -> Iterator[tuple[str, float]]:
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
    """Return what two texts have in common that nobody can hear the difference of."""
    return text.lower().strip(" ,;:.!?")


def _in_other_words(command: Command, first: Command) -> Command | None:
    """Return a command in the next of its other readings, as sure as that is."""
    if not command.others:
        return None
    (text, odds), *rest = command.others
    sure = first.heard_confidence
    if text != _bare(first.text):
        sure = min(READ_BACK, odds * (1.0 if sure is None else sure))
    return replace(command, text=text, others=tuple(rest), heard_confidence=sure)
