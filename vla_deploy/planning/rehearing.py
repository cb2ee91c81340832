"""Try what may have been said instead, where the words as they were read make no sense.

A recogniser that is unsure has several readings; the one with a plan in this room and this moment
is the likeliest. It is read back before anything moves.
"""

from dataclasses import dataclass, replace
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.inbox import Command
from vla_deploy.planning.ladder import Answer

READ_BACK: Final = 0.5
"""How surely another reading is heard at most: less than what is carried out unasked."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """Hold a command as it was read first, and what came of it."""

    command: Command
    request: Request
    answer: Answer


class Rehearing:
    """Remember of one command how it was read first."""

    def __init__(self) -> None:
        self._first: Heard | None = None

    def other(self, command: Command, request: Request, answer: Answer) -> Command | None:
        """Return the command in the next other words to try; None if it is to be concluded."""
        is_first = self._of(command) is None
        makes_sense = answer.is_final if is_first else answer.plan is not None
        if makes_sense or not command.others:
            return None
        if is_first:
            self._first = Heard(command=command, request=request, answer=answer)
        (text, odds), *rest = command.others
        sure = 1.0 if command.heard_confidence is None else command.heard_confidence
        return replace(
            command,
            text=text,
            others=tuple(rest),
            heard_confidence=min(READ_BACK, sure * odds),
        )

    def concluded(self, command: Command, request: Request, answer: Answer) -> Heard:
        """Return what is to be concluded: of readings without a plan the first."""
        first, self._first = self._of(command), None
        if first is None or answer.plan is not None:
            return Heard(command=command, request=request, answer=answer)
        return first

    def _of(self, command: Command) -> Heard | None:
        first = self._first
        same = first is not None and first.command.command_id == command.command_id
        return first if same else None
