"""List the tools that agents have: one table, with what each takes and when it may be used."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from vla_deploy.client.command_record import MOST_CHARACTERS
from vla_deploy.gateways.words import MOST_BYTES, checked_text
from vla_deploy.ipc.payloads.tasks import UtteranceContent

SHORTEST_WAIT_S: Final = 0.5
LONGEST_WAIT_S: Final = 60.0


class ToolKind(StrEnum):
    """Name when a tool may be used, which is the rule of the audit log, too."""

    READ = "read_only"
    STOP = "stop_always"
    ACT = "leased"


def _as_plan(plan: dict[str, Any]) -> dict[str, Any]:
    try:
        size = len(json.dumps(plan, allow_nan=False).encode())
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    if size > MOST_BYTES:
        raise ValueError(f"expected at most {MOST_BYTES} bytes, got {size}")
    return plan


_Text = Annotated[str, AfterValidator(checked_text)]
_Words = Annotated[_Text, Field(max_length=MOST_CHARACTERS)]
_Some = Annotated[int, Field(ge=1, le=50)]


class NoArguments(BaseModel):
    """Take nothing; each tool's arguments refuse what they do not name."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class SceneArguments(NoArguments):
    """Choose things by words; none choose all."""

    of: Annotated[str, Field(max_length=100, description='such as "small cup", "cup_1"')] = ""


class PlanArguments(NoArguments):
    """Give a command in words."""

    text: Annotated[_Words, Field(description="a command in words")]


class MemoryArguments(NoArguments):
    """Choose what is remembered."""

    like: Annotated[str, Field(max_length=500, description="only what is like these words")] = ""
    limit: _Some = 10


class RecordingsArguments(NoArguments):
    """Say how many at most."""

    limit: _Some = 20


class CommandsArguments(NoArguments):
    """Choose one command, or say how many at most."""

    command_id: Annotated[str, Field(max_length=128)] = ""
    limit: _Some = 10


class EstopArguments(NoArguments):
    """Say why, for the log."""

    reason: Annotated[str, Field(max_length=150)] = ""


class ActArguments(NoArguments):
    """Say how long the end of a command is waited for; the command goes on after that."""

    wait_s: Annotated[float, Field(ge=SHORTEST_WAIT_S, le=LONGEST_WAIT_S)] = 30.0

    def content(self) -> UtteranceContent:
        """Return what is said to the planner."""
        raise NotImplementedError


class CommandArguments(ActArguments):
    """Give a command in words."""

    text: Annotated[_Words, Field(description='such as "go to the kitchen"')]

    def content(self) -> UtteranceContent:
        """Return the words."""
        return {"text": self.text}


class ExecutePlanArguments(ActArguments):
    """Give a plan as JSON, as the tool `plan` returns it."""

    plan: Annotated[dict[str, Any], AfterValidator(_as_plan)]

    def content(self) -> UtteranceContent:
        """Return the plan."""
        return {"plan": self.plan}


class GoToArguments(ActArguments):
    """Name a place that the robot knows."""

    place: Annotated[_Text, Field(max_length=100)]

    def content(self) -> UtteranceContent:
        """Return a plan of one drive."""
        drive = {"id": "a1", "skill": "navigate_to", "parameters": {"place": self.place}}
        return {"plan": {"goal": f"go to {self.place}", "actions": [drive]}}


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentTool:
    """Describe one tool."""

    kind: ToolKind
    takes: type[NoArguments]
    what: str


_READ, _STOP, _ACT = ToolKind.READ, ToolKind.STOP, ToolKind.ACT
_FOLLOWS: Final = (
    " The robot's validator and safety judge it as everybody's; a question is answered by a person."
)
TOOLS: Final[Mapping[str, AgentTool]] = {
    "state": AgentTool(
        kind=_READ, takes=NoArguments, what="How the robot is, what it does, and the agents' lease."
    ),
    "scene": AgentTool(
        kind=_READ,
        takes=SceneArguments,
        what="The things that the robot knows of: where they are, what keeps it from taking them.",
    ),
    "plan": AgentTool(
        kind=_READ,
        takes=PlanArguments,
        what="Plan a command and do nothing: the plan, a question, or why it would be refused.",
    ),
    "memory": AgentTool(
        kind=_READ, takes=MemoryArguments, what="Commands of the past and what came of them."
    ),
    "recordings": AgentTool(
        kind=_READ, takes=RecordingsArguments, what="The newest flights and recordings, by name."
    ),
    "commands": AgentTool(
        kind=_READ,
        takes=CommandsArguments,
        what="The newest commands of everybody, or one with its events.",
    ),
    "stop": AgentTool(
        kind=_STOP,
        takes=NoArguments,
        what="End all that goes on; the robot rests and stays ready.",
    ),
    "estop": AgentTool(
        kind=_STOP,
        takes=EstopArguments,
        what="Press the software stop, which latches until a person resets it.",
    ),
    "command": AgentTool(
        kind=_ACT, takes=CommandArguments, what="Give the robot a command in words." + _FOLLOWS
    ),
    "execute_plan": AgentTool(
        kind=_ACT, takes=ExecutePlanArguments, what="Have a plan carried out." + _FOLLOWS
    ),
    "go_to": AgentTool(kind=_ACT, takes=GoToArguments, what="Drive to a known place." + _FOLLOWS),
}
"""Every tool; those that act are listed while a person has leased the robot."""


def listed_tools(*, may_act: bool) -> dict[str, AgentTool]:
    """Return the tools that are listed now."""
    return {name: one for name, one in TOOLS.items() if may_act or one.kind is not ToolKind.ACT}
