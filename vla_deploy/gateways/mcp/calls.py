"""Carry out the calls of agents: check each, audit it with the rule that decided, and answer it."""

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

import anyio
import anyio.to_thread
from pydantic import ValidationError

from vla_deploy.client.access.audit_log import (
    FOLD_S,
    STOP_FOLD_S,
    AuditEntry,
    AuditLog,
    AuditOutcome,
)
from vla_deploy.client.agent_lease import AGENT, sender_of
from vla_deploy.client.escaping import escaped_document
from vla_deploy.gateways.mcp.acting import RobotActs
from vla_deploy.gateways.mcp.errors import CallRefused, NoRobot
from vla_deploy.gateways.mcp.reading import RobotReader
from vla_deploy.gateways.mcp.robot_access import RobotAccess
from vla_deploy.gateways.mcp.tools import TOOLS, ActArguments, AgentTool, NoArguments, ToolKind
from vla_deploy.inference.errors import InferenceError
from vla_deploy.ipc.errors import IpcError
from vla_deploy.memory.errors import RecollectionError
from vla_deploy.plans.agent_rules import AgentRefused
from vla_deploy.plans.errors import PlanError
from vla_deploy.robots.errors import RobotError
from vla_deploy.supervisor.errors import SupervisorError
from vla_deploy.world.errors import WorldError

_UNKNOWN_TOOL: Final = "(unknown)"
_MOST_FAULTS: Final = 5
_FAULTS: Final = (
    NoRobot, IpcError, PlanError, WorldError, RecollectionError, RobotError, InferenceError,
    SupervisorError, OSError,
)  # fmt: skip
"""What a person may have to mend: their words are for the agent, too."""
_REFUSED_STATES: Final = {"rejected": "robot_refused", "asked": "person_answers"}
_AT_ONCE: Final = {ToolKind.READ: 1, ToolKind.STOP: 8, ToolKind.ACT: 4}
"""So many calls of one kind go on at a time: none pushes what a person says out of the ring."""
_FOLDED_S: Final = {ToolKind.READ: FOLD_S, ToolKind.STOP: STOP_FOLD_S, ToolKind.ACT: 0.0}
"""Within this time the calls of one kind are one entry of the audit log, with their count."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentName:
    """Say who calls, and from where."""

    client: str
    address: str = "stdio"

    @property
    def sender(self) -> str:
        """Return the source of its commands."""
        return sender_of(self.client)


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolAnswer:
    """Hold what came of a call: the rule that decided, and the data or why it is refused."""

    rule: str
    outcome: AuditOutcome
    data: Any = None
    why: str = ""

    @property
    def is_error(self) -> bool:
        """Return whether nothing was done."""
        return self.outcome is not AuditOutcome.DONE

    def document(self) -> dict[str, Any]:
        """Return it as JSON; texts of the world control no terminal."""
        told: dict[str, Any] = {"rule": self.rule}
        if self.why:
            told["refused"] = self.why
        if self.data is not None:
            told["data"] = self.data
        return cast("dict[str, Any]", escaped_document(told))


class AgentCalls:
    """Carry out calls of several agents; a stop waits for no other call."""

    def __init__(
        self, access: RobotAccess, acts: RobotActs, reader: RobotReader, audit: AuditLog
    ) -> None:
        """Take `access` and `acts` for the event loop, `reader` for a thread of its own."""
        self._access = access
        self._acts = acts
        self._reader = reader
        self._audit = audit
        self._turns = {kind: anyio.CapacityLimiter(most) for kind, most in _AT_ONCE.items()}

    def may_act(self) -> bool:
        """Return whether tools that act may be used now."""
        try:
            return self._access.lease().is_live
        except _FAULTS:
            return False

    async def call(
        self, name: str, arguments: Mapping[str, Any] | None, who: AgentName
    ) -> ToolAnswer:
        """Carry out one call; whatever comes of it is an answer, and an entry of the audit log."""
        tool = TOOLS.get(name)
        try:
            answer = await self._judged(name, tool, arguments or {}, who)
        except CallRefused as error:
            answer = ToolAnswer(rule=error.rule, outcome=AuditOutcome.REFUSED, why=str(error))
        except _FAULTS as error:
            answer = ToolAnswer(rule="unavailable", outcome=AuditOutcome.FAILED, why=str(error))
        except Exception:  # the server's main loop: one call's fault ends no other call
            _log.exception("the tool %.40r failed", name)
            why = "the tool failed; see the log of vla-deploy mcp"
            answer = ToolAnswer(rule="failed", outcome=AuditOutcome.FAILED, why=why)
        self._record(name if tool else _UNKNOWN_TOOL, tool, arguments or {}, who, answer)
        return answer

    def close(self) -> None:
        """Write the audit entries that wait, and let go of the robot."""
        self._audit.close()
        self._access.close()

    async def _judged(
        self, name: str, tool: AgentTool | None, arguments: Mapping[str, Any], who: AgentName
    ) -> ToolAnswer:
        if tool is None:
            raise CallRefused("no_such_tool", f"no such tool; there are {', '.join(TOOLS)}")
        lease = self._access.lease() if tool.kind is ToolKind.ACT else None
        if lease is not None and not lease.is_live:
            raise CallRefused(lease.rule.value, lease.refusal)
        given = _checked(tool, arguments)
        if tool.kind is ToolKind.READ:
            read = getattr(self._reader, name)
            values = given.model_dump().values()
            turn = self._turns[tool.kind]
            data = await anyio.to_thread.run_sync(lambda: read(*values), limiter=turn)
            return ToolAnswer(rule=tool.kind, outcome=AuditOutcome.DONE, data=data)
        async with self._turns[tool.kind]:
            data = await self._act(name, given, who.sender)
        is_refused = data["state"] == "rejected"
        rule = _REFUSED_STATES.get(data["state"], tool.kind.value)
        if is_refused:
            rule = AgentRefused.rule_of(data["reason"]) or rule
        outcome = AuditOutcome.REFUSED if is_refused else AuditOutcome.DONE
        return ToolAnswer(rule=rule, outcome=outcome, data=data)

    async def _act(self, name: str, given: NoArguments, sender: str) -> dict[str, Any]:
        if isinstance(given, ActArguments):
            return await self._acts.command(sender, given.wait_s, **given.content())
        act = getattr(self._acts, name)
        data: dict[str, Any] = await act(sender, **given.model_dump())
        return data

    def _record(
        self,
        name: str,
        tool: AgentTool | None,
        arguments: Mapping[str, Any],
        who: AgentName,
        answer: ToolAnswer,
    ) -> None:
        data = answer.data if isinstance(answer.data, dict) else {}
        given = {str(key): _told(value) for key, value in list(arguments.items())[:4]}
        entry = AuditEntry(
            user=who.sender,
            role=AGENT,
            way="mcp",
            address=who.address,
            act=f"tool {name}",
            outcome=answer.outcome,
            code=answer.rule,
            details={**given, "given": data.get("command_id", ""), "why": answer.why},
        )
        self._audit.record(entry, _FOLDED_S[tool.kind] if tool else 0.0)


def _told(value: Any) -> str:
    """Return an argument for the audit log, which cuts it; its form may be any."""
    if isinstance(value, str):
        return value
    try:
        return json.dumps(value)
    except (RecursionError, ValueError, TypeError):
        return f"({type(value).__name__} that is no JSON)"


def _checked(tool: AgentTool, arguments: Mapping[str, Any]) -> NoArguments:
    """Return the arguments of a tool.

    Raises:
        CallRefused: they are not what it takes; says what was expected, and repeats nothing.
    """
    try:
        return tool.takes.model_validate(dict(arguments))
    except ValidationError as error:
        faults = error.errors(include_input=False, include_url=False)[:_MOST_FAULTS]
        told = [f"{'.'.join(map(str, one['loc']))[:60]}: {one['msg'][:200]}" for one in faults]
        raise CallRefused("bad_arguments", "; ".join(told)) from None
    except RecursionError:
        raise CallRefused("bad_arguments", "nested too deeply") from None
