"""Find what an earlier planner of this run left behind when it ended."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.ipc import Event
from vla_deploy.planning.dialogue.command import command_id_of

# What the planner says of a command that only it knows of.
_IN_WORK: Final = frozenset({"queued", "planning", "asked"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Unfinished:
    """Hold utterances without an answer, and ids of commands that were being planned.

    For those that are `set_back` the executor waits for another plan.
    """

    unheard: tuple[Event, ...]
    in_work: tuple[str, ...]
    set_back: tuple[str, ...]


def unfinished(
    utterances: Sequence[Event], events: Sequence[Event], plans: Sequence[Event]
) -> Unfinished:
    """Return what the topics hold of the time before; nothing in a run that has just begun."""
    last = {command_id_of(event): str(event.payload.get("event", "")) for event in events}
    answered = last.keys() | {command_id_of(event) for event in plans}
    return Unfinished(
        unheard=tuple(one for one in utterances if command_id_of(one) not in answered),
        in_work=tuple(name for name, event in last.items() if event in _IN_WORK),
        set_back=tuple(name for name, event in last.items() if event == "setback"),
    )
