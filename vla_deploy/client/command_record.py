"""Remember one command: who gave it, what became of it, how it stands."""

import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from vla_deploy.ipc.payloads.tasks import FinishedEvent, RejectedEvent, TaskEvent, Utterance

MOST_EVENTS: Final = 400
MOST_CHARACTERS: Final = 1000
"""Of one command in words."""
_ENDED_BY_PERSON: Final = ("cancelled on request", "stopped on request")
_PART: Final = re.compile(r"(?P<mission>.+)/(?P<part>[\w-]+\.[\w-]+)(?:\+\d+)?")
_OF_CANCEL: Final = "-cancel"
"""Ends the id of what the planner asks the executor for by itself: to end one command."""


class Kind(StrEnum):
    """Name what an utterance is."""

    COMMAND = "command"
    ANSWER = "answer"
    CANCEL = "cancel"
    PAUSE = "pause"
    RESUME = "resume"


class Standing(StrEnum):
    """Name how a command stands; the last six are final."""

    GIVEN = "given"
    QUEUED = "queued"
    PLANNING = "planning"
    ASKED = "asked"
    ACTIVE = "active"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"
    REJECTED = "rejected"
    ANSWERED = "answered"
    LOST = "lost"

    @property
    def is_final(self) -> bool:
        """Return whether nothing more comes."""
        return self in _FINAL


_FINAL: Final = frozenset(
    {
        Standing.SUCCEEDED,
        Standing.FAILED,
        Standing.CANCELLED,
        Standing.REJECTED,
        Standing.ANSWERED,
        Standing.LOST,
    }
)
_AFTER: Final[Mapping[str, Standing]] = {
    "queued": Standing.QUEUED,
    "planning": Standing.PLANNING,
    "asked": Standing.ASKED,
    "answered": Standing.ANSWERED,
    "accepted": Standing.ACTIVE,
    "plan": Standing.ACTIVE,
    "action": Standing.ACTIVE,
    "objective": Standing.ACTIVE,
}


def _finished(event: FinishedEvent) -> Standing:
    error = event["error"] or ""
    if event["success"]:
        return Standing.SUCCEEDED
    if error.startswith("lost"):
        return Standing.LOST
    return Standing.CANCELLED if error.endswith(_ENDED_BY_PERSON) else Standing.FAILED


def _rejected(event: RejectedEvent) -> Standing:
    is_cancelled = event["reason"] in _ENDED_BY_PERSON
    return Standing.CANCELLED if is_cancelled else Standing.REJECTED


def part_of(command_id: str) -> tuple[str, str]:
    """Return the mission that a command is a part of, and which part; "" and "" of none."""
    found = _PART.fullmatch(command_id)
    return (found["mission"], found["part"]) if found else ("", "")


def is_of_planner(command_id: str) -> bool:
    """Return whether nobody gave this command: the planner's own request to end another one."""
    return command_id.endswith(_OF_CANCEL)


@dataclass(slots=True, kw_only=True)
class CommandRecord:
    """Hold one command; of its events the newest `MOST_EVENTS` are kept.

    `given_s` and each event's `at_s` are Unix seconds. `lost_events` were pushed out before anybody
    could read them, or by newer ones. `mission` is the id of the one that it is a part of, or "".
    """

    command_id: str
    source: str
    kind: Kind = Kind.COMMAND
    text: str = ""
    plan: Any = None
    given_s: float
    standing: Standing = Standing.GIVEN
    mission: str = ""
    lost_events: int = 0
    events: deque[dict[str, Any]] = field(default_factory=deque)

    def note(self, event: TaskEvent, at_s: float) -> None:
        """Add an event, and judge by it how the command stands."""
        if event["event"] == "finished":
            self.standing = _finished(event)
        elif event["event"] == "rejected":
            self.standing = _rejected(event)
        else:
            self.standing = _AFTER.get(event["event"], self.standing)
        self.events.append({**event, "at_s": round(at_s, 3)})
        if len(self.events) > MOST_EVENTS:
            self.events.popleft()
            self.lost_events += 1

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "command_id": self.command_id,
            "source": self.source,
            "kind": self.kind.value,
            "text": self.text,
            "plan": self.plan,
            "given_s": round(self.given_s, 3),
            "state": self.standing.value,
            "is_final": self.standing.is_final,
            "mission": self.mission,
            "lost_events": self.lost_events,
            "events": list(self.events),
        }


def record_of(utterance: Utterance, given_s: float) -> CommandRecord:
    """Return the record of what was said to the planner."""
    kind = Kind.COMMAND
    for word in (Kind.ANSWER, Kind.CANCEL):
        kind = word if utterance.get(word.value) else kind
    if "pause" in utterance:
        kind = Kind.PAUSE if utterance["pause"] else Kind.RESUME
    if "mission_act" in utterance:
        kind = Kind.CANCEL
    return CommandRecord(
        command_id=str(utterance.get("command_id", "")),
        source=str(utterance.get("source", "")),
        kind=kind,
        text=str(utterance.get("text", "")) or _goal_of(utterance.get("mission")),
        plan=utterance.get("plan"),
        given_s=given_s,
    )


def _goal_of(mission: Any) -> str:
    if mission is None:
        return ""
    named = mission if isinstance(mission, Mapping) else {}
    return str(named.get("goal") or named.get("name") or "mission")
