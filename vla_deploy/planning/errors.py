"""Group planning errors by what the person who gave the command can do.

PlanningError
├── CommandUnreadable give words or a plan, no more than fits
├── NotUnderstood     say it in other words
├── UnknownPlace      name a place the robot knows
├── UnknownObject     name a kind of object the robot knows
│   └── DependsOnView say what it stands on, in or next to
├── CannotBeDone      ask for something else: a planner has seen that this cannot be done
│   └── NotAble       nor can any other planner: the robot lacks what it takes, or it is not there
├── Declined          ask the next back end: this one has no plan
├── Ambiguous         answer its question; carries the candidates
├── NotReady          reset and arm the robot first
└── PlanInvalid       mend the plan; carries every fault
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vla_deploy.planning.understanding.conversation import Candidate


class PlanningError(Exception):
    """Base of everything that planning refuses."""


class CommandUnreadable(PlanningError):
    """Say what was expected of a command."""


class NotUnderstood(PlanningError):
    """Say that no rule covers the command."""

    def __init__(self, text: str) -> None:
        super().__init__(
            f'I do not understand "{text}"; try: go to the kitchen, find the keys, '
            "pick up the red cup and put it in the box, bring me the bottle, stop"
        )


class UnknownPlace(PlanningError):
    """Say that a place is not in the robot file."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        super().__init__(f'I do not know the place "{name}"; I know: {", ".join(sorted(known))}')


class UnknownObject(PlanningError):
    """Say that a kind of object is none the robot can recognise."""

    def __init__(self, name: str, known: Iterable[str]) -> None:
        super().__init__(
            f'I do not know the object "{name}"; I can handle: {", ".join(sorted(known))}'
        )


class DependsOnView(UnknownObject):
    """Say that where an object is depends on who looks, and changes while the robot drives."""

    def __init__(self, name: str) -> None:
        PlanningError.__init__(
            self,
            f'"{name}": left, right, in front and behind change while I drive; say what it is '
            "on, in or next to",
        )


class CannotBeDone(PlanningError):
    """Say why a planner thinks that a command cannot be carried out."""


class NotAble(CannotBeDone):
    """Say what the robot lacks for it, or that nothing such is there, for any planner."""


class Declined(PlanningError):
    """Say why one back end has no plan for a command; the next one is asked."""


class Ambiguous(PlanningError):
    """Ask the person who gave the command what is meant; the message is the question.

    `expression` is the part of the command that is unclear. Without candidates the answer is yes
    or no.
    """

    def __init__(
        self, question: str, candidates: "Sequence[Candidate]" = (), expression: str = ""
    ) -> None:
        self.question = question
        self.candidates = tuple(candidates)
        self.expression = expression
        super().__init__(question)


class NotReadyToMove(PlanningError):
    """Say why the robot may not move now, and what to do about it."""


class PlanInvalid(PlanningError):
    """Say everything that is wrong with a plan, in one line."""

    def __init__(self, faults: Sequence[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("the plan was refused: " + "; ".join(self.faults))
