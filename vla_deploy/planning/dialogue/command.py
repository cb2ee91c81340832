"""Read what people and programs give the planner to do; nothing of it is trusted to be whole."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Final

from vla_deploy.client.agent_lease import is_agent
from vla_deploy.client.command_record import MOST_CHARACTERS
from vla_deploy.ipc import Event
from vla_deploy.ipc.payloads.tasks import PlanMessage, TaskEvent, Utterance
from vla_deploy.planning.errors import CommandUnreadable, NotUnderstood
from vla_deploy.planning.interfaces import PlanningResult, PlanRequest
from vla_deploy.planning.patterns.steering import awaiting, is_stop
from vla_deploy.planning.scope import negates
from vla_deploy.planning.understanding.quantities import numbers_in

VOICE: Final = "voice"
READ_BACK: Final = 0.5
"""How surely doubted or other words are heard at most: less than what is carried out unasked."""
WELL_HEARD: Final = 0.75
LEAST_INSTEAD: Final = 0.15
"""Words heard less surely are read back, where others are so likely."""
_ID_CHARACTERS: Final = 128
_MOST_OTHERS: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class UserCommand:
    """Hold one utterance: words, or a `plan` made elsewhere.

    `heard_confidence`, 0 to 1, is how sure the recogniser is of the words; None for typed text.
    `others` are what may have been said instead, the likeliest first, each with its probability
    over that of the words; with `is_doubted` the words are not sure enough to act by, and with
    `may_ask_again` they may be asked for once more. With `is_answer` the words are no
    command of their own; with `recovers` it is under way already, and what is planned for it goes
    on after a failure. One that `is_corrected`, by "no, the blue one", is read back.
    With `awaits_word` the plan is held until the person says go. `mission` is the id of the one
    that it is a part of.
    """

    command_id: str
    told_ns: int
    source: str = ""
    text: str = ""
    plan: Any = None
    heard_confidence: float | None = None
    others: tuple[tuple[str, float], ...] = ()
    is_doubted: bool = False
    may_ask_again: bool = False
    is_corrected: bool = False
    awaits_word: bool = False
    is_answer: bool = False
    recovers: bool = False
    mission: str = ""

    @property
    def is_unsure(self) -> bool:
        """Return whether its words are read back before anything moves."""
        return self.heard_confidence is not None and self.heard_confidence <= READ_BACK

    def may_have_been(self) -> tuple[str, ...]:
        """Return the other readings that are so likely that they count."""
        return tuple(text for text, odds in self.others if odds >= LEAST_INSTEAD)

    @property
    def is_of_agent(self) -> bool:
        """Return whether an agent gave it."""
        return is_agent(self.source)

    @property
    def is_spoken(self) -> bool:
        """Return whether it came by voice, so that answers are spoken too."""
        return self.source == VOICE


@dataclass(frozen=True, slots=True)
class PlannedCommand:
    """Hold a command, the request that was made of it, and what came of that."""

    command: UserCommand
    request: PlanRequest
    answer: PlanningResult

    @property
    def awaits_word(self) -> bool:
        """Return whether its plan is held until the person says go."""
        proposal = self.answer.proposal
        return self.command.awaits_word or (proposal is not None and proposal.awaits_word)


CommandEvent = Event[Utterance] | Event[TaskEvent] | Event[PlanMessage]


def asks_to_stop(event: Event[Utterance]) -> bool:
    """Return whether the words of an utterance want what is under way to end."""
    return is_stop(str(event.payload.get("text", "")))


def command_id_of(event: CommandEvent) -> str:
    """Return the id that answers to an utterance carry; one that is too long is cut."""
    return str(event.payload.get("command_id", ""))[:_ID_CHARACTERS]


def read_command(
    event: Event[Utterance], read: Callable[[str], str] = lambda text: text
) -> UserCommand:
    """Return the command that an utterance holds; `read` puts its words as the robot knows them.

    Raises:
        CommandUnreadable: it holds none, or one that is too long.
        NotUnderstood: there are no words in it.
    """
    given: Mapping[str, Any] = event.payload
    plan = given.get("plan")
    text = read(_words(given)) if plan is None else ""
    rest = awaiting(text)
    heard: Any = given.get("heard")
    heard = heard if isinstance(heard, Mapping) else {}
    command = UserCommand(
        command_id=command_id_of(event),
        told_ns=event.stamp_ns,
        source=str(given.get("source", "")),
        text=text if rest is None else rest,
        plan=plan,
        heard_confidence=_ratio(heard.get("confidence")),
        others=tuple(
            (read(one), odds) for one, odds in islice(_others(heard.get("others")), _MOST_OTHERS)
        ),
        is_doubted=bool(heard.get("doubted")),
        may_ask_again=bool(heard.get("ask_again")),
        is_answer=bool(given.get("answer")),
        awaits_word=rest is not None,
    )
    return _bounded(command)


def _words(given: Mapping[str, Any]) -> str:
    text = given.get("text")
    if not isinstance(text, str):
        raise CommandUnreadable(f"expected a command in words or a plan, got {dict(given)!r:.120}")
    if not text.strip():
        raise NotUnderstood(text)
    if len(text) > MOST_CHARACTERS:
        raise CommandUnreadable(
            f"expected a command of at most {MOST_CHARACTERS} characters, got {len(text)}; "
            "say less at a time"
        )
    return text.strip()


def _bounded(command: UserCommand) -> UserCommand:
    """Return a command as sure as it is heard; of unsure words so little that they are read back.

    "90" may be heard as "19", and a "don't" may not be heard at all. A "one" where no number was
    read mostly stands for a thing: "the red one".
    """
    sure, text = command.heard_confidence, command.text
    numbers = numbers_in(text)
    others = {numbers_in(one) for one, _ in command.others}
    is_unsure = (
        command.is_doubted
        or (sure is not None and sure < WELL_HEARD and bool(command.may_have_been()))
        or bool(others - {numbers, (), (1.0,) if not numbers else ()})
        or (not negates(text) and any(negates(one) for one, _ in command.others))
    )
    if not is_unsure:
        return command
    return replace(command, heard_confidence=READ_BACK if sure is None else min(sure, READ_BACK))


def _ratio(value: Any) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    return min(1.0, max(0.0, float(value)))


def _others(given: Any) -> Iterator[tuple[str, float]]:
    for one in given if isinstance(given, list) else []:
        reading = one if isinstance(one, Mapping) else {}
        text, odds = reading.get("text"), _ratio(reading.get("odds"))
        if isinstance(text, str) and text.strip() and odds and len(text) <= MOST_CHARACTERS:
            yield text.strip(), odds
