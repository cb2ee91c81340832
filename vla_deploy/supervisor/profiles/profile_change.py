"""Hold what one profile change is about: whom it concerns, how far it is, what was answered."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from platforms import Profile

PREPARE_S: Final = 30.0
SET_POWER_S: Final = 15.0
COMMIT_S: Final = 2.0
RESTART_S: Final = 30.0
WATCH_S: Final = 3.0
VALIDATE_S: Final = 2.0
ROLLBACK_S: Final = 5.0


class ChangePhase(StrEnum):
    """Name where a change stands; the words of `profile_change` are among them."""

    PREPARE = "prepare"
    SET_POWER = "set power mode"
    COMMIT = "commit"
    WATCH = "watch"
    VALIDATE = "validate"
    ROLLBACK = "rollback"


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
    values: Mapping[str, Any]
    pids: dict[str, int]
    phase: ChangePhase = ChangePhase.PREPARE
    began_ns: int = 0
    deadline_ns: int = 0
    committed: bool = False
    answers: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    restarts: dict[str, float] = field(default_factory=dict)
    """Who is to be started again, with the share of its steps that it made before."""
    was_slow: bool = False
    """Somebody has been watched a second time: a moment's load of others takes no profile back."""
    power_before: str = ""
    failure: str = ""

    @property
    def silent(self) -> tuple[str, ...]:
        """Name who has not answered this phase."""
        return tuple(
            name for name in self.pids if name not in self.answers and name not in self.restarts
        )

    @property
    def refusals(self) -> dict[str, str]:
        """Return who said no in this phase, and why."""
        return {name: answer["reason"] for name, answer in self.answers.items() if not answer["ok"]}

    def enter(self, phase: ChangePhase, now_ns: int, limit_ns: int) -> None:
        """Begin a phase."""
        self.phase = phase
        self.deadline_ns = now_ns + limit_ns
        self.answers = {}

    def settle(self, pids: Mapping[str, int]) -> dict[str, float]:
        """Count the processes that were started again among all others; return `restarts`."""
        restarted, self.restarts = self.restarts, {}
        self.pids.update({name: pids[name] for name in restarted})
        return restarted

    def note(self, answer: Mapping[str, Any]) -> None:
        """Take in an answer to the present phase."""
        fits = answer["change_id"] == self.change_id and answer["phase"] == self.phase
        if fits and answer["process"] in self.pids.keys() - self.restarts.keys():
            self.answers[answer["process"]] = answer
