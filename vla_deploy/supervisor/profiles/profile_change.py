"""Hold and report what one profile change is about: its processes, its phase, its answers."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from platforms import Profile
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import ConcludedRequest, ProfileAnswer


class ChangePhase(StrEnum):
    """Name the phase of a change; but for `SET_POWER`, the topic `profile_change` carries it."""

    PREPARE = "prepare"
    SET_POWER = "set power mode"
    COMMIT = "commit"
    WATCH = "watch"
    VALIDATE = "validate"
    ROLLBACK = "rollback"


LIMITS_S: Final[Mapping[ChangePhase, float]] = {
    ChangePhase.PREPARE: 30.0,
    ChangePhase.SET_POWER: 15.0,
    ChangePhase.COMMIT: 2.0,
    ChangePhase.WATCH: 3.0,
    ChangePhase.VALIDATE: 2.0,
    ChangePhase.ROLLBACK: 5.0,
}
RESTART_S: Final = 30.0
"""The limit of a commit for which processes are started again."""


class ChangeOutcome(StrEnum):
    """Name how a request ended."""

    KEPT = "kept"
    WOULD_WORK = "would work"
    REFUSED = "refused"
    ROLLED_BACK = "rolled back"


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """Identify a running process that follows profiles, and what it was started with."""

    pid: int
    started_under: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileRequest:
    """Ask for a profile."""

    request_id: str
    profile: str
    allow_restart: bool = False
    dry_run: bool = False

    @classmethod
    def of(cls, payload: Mapping[str, Any]) -> "ProfileRequest":
        """Read a request from its topic."""
        return cls(
            request_id=str(payload.get("request_id", "")),
            profile=str(payload.get("profile", "")),
            allow_restart=bool(payload.get("allow_restart")),
            dry_run=bool(payload.get("dry_run")),
        )


@dataclass(slots=True, kw_only=True)
class ProfileChange:
    """Follow one change through its phases."""

    change_id: int
    request: ProfileRequest
    target: Profile
    pids: dict[str, int]
    began_ns: int
    phase: ChangePhase = ChangePhase.PREPARE
    deadline_ns: int = 0
    committed: bool = False
    answers: dict[str, ProfileAnswer] = field(default_factory=dict)
    restarts: dict[str, float] = field(default_factory=dict)
    """The processes to start again, each with the share of its rate that it reached before."""
    was_slow: bool = False
    """A process has been watched a second time: one moment of load ends no change."""
    power_before: str = ""
    failure: str = ""

    @property
    def silent(self) -> tuple[str, ...]:
        """Return the processes that have not answered this phase."""
        return tuple(
            name for name in self.pids if name not in self.answers and name not in self.restarts
        )

    @property
    def refusals(self) -> dict[str, str]:
        """Return the processes that refuse this phase, and why."""
        return {name: answer["reason"] for name, answer in self.answers.items() if not answer["ok"]}

    def enter(self, phase: ChangePhase, deadline_ns: int) -> None:
        """Begin a phase, without an answer yet."""
        self.phase, self.deadline_ns, self.answers = phase, deadline_ns, {}

    def settle(self, pids: Mapping[str, int]) -> dict[str, float]:
        """Treat the processes that were started again like all others; return `restarts`."""
        restarted, self.restarts = self.restarts, {}
        self.pids.update({name: pids[name] for name in restarted})
        return restarted

    def note(self, answer: ProfileAnswer) -> None:
        """Note an answer to the present phase."""
        fits = answer["change_id"] == self.change_id and answer["phase"] == self.phase
        if fits and answer["process"] in self.pids.keys() - self.restarts.keys():
            self.answers[answer["process"]] = answer


_PERIOD_NS: Final = NS_PER_S // 2
_MOST_CHARACTERS: Final = 2000
_log = logging.getLogger(__name__)


class ProfileReport:
    """Write the `profile_status` cell, and the log's line about each request."""

    def __init__(self, space: SharedSpace, clock: Clock, begun_with: str) -> None:
        """Report throughout the run also the profile that it has `begun_with`."""
        self._begun_with = begun_with
        self._cell = space.cell_writer(topics.PROFILE_STATUS)
        self._clock = clock
        self._last: ConcludedRequest = {}
        self._due_ns = 0

    def conclude(
        self, request: ProfileRequest, outcome: ChangeOutcome, reason: str, took_s: float
    ) -> None:
        """Log and publish how a request ended."""
        level = (
            logging.INFO
            if outcome in (ChangeOutcome.KEPT, ChangeOutcome.WOULD_WORK)
            else logging.WARNING
        )
        _log.log(level, "profile %s: %s%s", request.profile, outcome, reason and f" ({reason})")
        self._last = {
            "request_id": request.request_id,
            "profile": request.profile,
            "outcome": outcome.value,
            "reason": reason[:_MOST_CHARACTERS],
            "took_s": round(took_s, 3),
        }
        self._due_ns = 0

    def publish(self, profile: str, change: ProfileChange | None, fault: str) -> None:
        """Publish twice a second, and at once after an end; `fault` is as in `ProfileSwitch`."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _PERIOD_NS
        self._cell.put_document(
            {
                "profile": profile,
                "begun_with": self._begun_with,
                "phase": change.phase.value if change else "",
                "target": change.request.profile if change else "",
                "last": self._last,
                "fault": fault,
            }
        )
