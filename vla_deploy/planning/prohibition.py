"""Say what a person may forbid the robot, and permit again."""

from dataclasses import dataclass
from enum import StrEnum


class Forbidden(StrEnum):
    """Name what may be forbidden."""

    THING = "thing"
    PLACE = "place"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prohibition:
    """Hold what is forbidden: the words for a thing, or the name of a place."""

    what: Forbidden
    words: str

    def __str__(self) -> str:
        """Return it as one says it."""
        named = self.words.replace("_", " ")
        verb = "touch the" if self.what is Forbidden.THING else "go into the"
        return f"{verb} {named}"


@dataclass(frozen=True, slots=True, kw_only=True)
class StandingOrder:
    """Hold a command that forbids something, or permits it again."""

    forbids: bool
    of: Prohibition

    @property
    def answer(self) -> str:
        """Return what the robot says to it."""
        return f"All right, I will {'not' if self.forbids else 'now'} {self.of}."

    @property
    def question(self) -> str:
        """Return what is asked before it stands; to forbid something is safe at once."""
        return "" if self.forbids else f"May I {self.of} again?"
