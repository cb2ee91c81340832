"""Lease the robot to agents for a while: who may give commands is decided by a person.

A lease is a document of the run's shared memory, so it ends with the run. It counts by the run's
clock. An agent's commands carry its name as their source, `agent:<name>`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import CellReader, SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import AgentLease

AGENT: Final = "agent"
LONGEST_MINUTES: Final = 60
_LONGEST_NS: Final = LONGEST_MINUTES * 60 * NS_PER_S
_MOST_LETTERS: Final = 40
_NO_NAME: Final = re.compile(r"[^A-Za-z0-9._-]+")


class LeaseRule(StrEnum):
    """Name why agents may give commands now, or why not."""

    LEASED = "leased"
    NOT_LEASED = "not_leased"
    REVOKED = "lease_revoked"
    EXPIRED = "lease_expired"
    INVALID = "lease_invalid"


_WHY: Final[Mapping[LeaseRule, str]] = {
    LeaseRule.LEASED: "",
    LeaseRule.NOT_LEASED: "nobody has leased the robot to agents",
    LeaseRule.REVOKED: "the lease was taken back",
    LeaseRule.EXPIRED: "the lease has ended",
    LeaseRule.INVALID: f"the lease is none: expected an end within {LONGEST_MINUTES} min",
}
_HOW: Final = "a person grants one on the robot: vla-deploy agent lease --minutes 10"


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseState:
    """Hold whether agents may give commands, for how long yet, and by whose leave."""

    rule: LeaseRule
    left_s: float = 0.0
    granted_by: str = ""

    @property
    def is_live(self) -> bool:
        """Return whether agents may give commands."""
        return self.rule is LeaseRule.LEASED

    @property
    def refusal(self) -> str:
        """Return why agents may not, and how a person permits it; "" while they may."""
        return "" if self.is_live else f"{_WHY[self.rule]}; {_HOW}"

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "may_act": self.is_live,
            "rule": self.rule.value,
            "left_s": round(self.left_s, 1),
            "granted_by": self.granted_by,
            "refusal": self.refusal,
        }


def judge_lease(lease: Mapping[str, Any] | None, now_ns: int) -> LeaseState:
    """Return how a lease stands; one longer than any that is granted counts as none."""
    if lease is None:
        return LeaseState(rule=LeaseRule.NOT_LEASED)
    granted_ns, until_ns = lease.get("granted_ns"), lease.get("until_ns")
    by = str(lease.get("granted_by", ""))
    if lease.get("revoked_by"):
        return LeaseState(rule=LeaseRule.REVOKED, granted_by=by)
    if not isinstance(granted_ns, int) or not isinstance(until_ns, int):
        return LeaseState(rule=LeaseRule.INVALID, granted_by=by)
    if granted_ns > now_ns or not 0 < until_ns - granted_ns <= _LONGEST_NS:
        return LeaseState(rule=LeaseRule.INVALID, granted_by=by)
    if now_ns >= until_ns:
        return LeaseState(rule=LeaseRule.EXPIRED, granted_by=by)
    left_s = (until_ns - now_ns) / NS_PER_S
    return LeaseState(rule=LeaseRule.LEASED, left_s=left_s, granted_by=by)


def sender_of(client_name: str) -> str:
    """Return the source of an agent's commands: its client's name in plain letters, cut short."""
    name = _NO_NAME.sub("_", client_name[: 2 * _MOST_LETTERS]).strip("_")[:_MOST_LETTERS]
    return f"{AGENT}:{name or 'unnamed'}"


def is_agent(source: str) -> bool:
    """Return whether a command's source is an agent."""
    return source.partition(":")[0].strip().lower() == AGENT


class LeaseKeeper:
    """Grant and take back the lease of one run, and say how it stands."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        """Open nothing yet: who only reads creates no lease."""
        self._space = space
        self._clock = clock
        self._reader: CellReader[AgentLease] | None = None

    def grant(self, by: str, minutes: float) -> LeaseState:
        """Let agents give commands from now on; a lease that stands is replaced.

        Raises:
            ValueError: `minutes` is not above 0 and at most 60.
        """
        if not 0.0 < minutes <= LONGEST_MINUTES:
            raise ValueError(f"expected minutes above 0, at most {LONGEST_MINUTES}, got {minutes}")
        now_ns = self._clock.now_ns()
        until_ns = now_ns + round(minutes * 60 * NS_PER_S)
        return self._change(
            {"granted_ns": now_ns, "until_ns": until_ns, "granted_by": by, "revoked_by": ""}
        )

    def revoke(self, by: str) -> LeaseState:
        """Take the lease back; where there is none, nothing changes."""
        lease = self._lease()
        return self.state() if lease is None else self._change({**lease, "revoked_by": by})

    def state(self) -> LeaseState:
        """Return how the lease stands now."""
        return judge_lease(self._lease(), self._clock.now_ns())

    def _lease(self) -> AgentLease | None:
        if self._reader is None:
            self._reader = self._space.cell_reader(topics.AGENT_LEASE)
        sample = self._reader.latest()
        return None if sample is None else sample.document()

    def _change(self, lease: AgentLease) -> LeaseState:
        shared = self._space.shared_document(topics.AGENT_LEASE)
        try:
            return judge_lease(shared.change(lambda _before: lease), self._clock.now_ns())
        finally:
            shared.close()
