from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from platforms import ModelChoice, ProcessSettings, load_profile
from platforms.board import identify
from platforms.tree import Tree, ValueMissing
from vla_deploy.doctor import DoctorContext, DoctorFinding
from vla_deploy.doctor.context import UNLIMITED, Rights
from vla_deploy.inference.store import ModelStore
from vla_deploy.robots import load_robot

ALL_RIGHTS = Rights(
    uid=1000,
    fifo_refusal="",
    realtime_priority_limit=80,
    memory_lock_bytes=UNLIMITED,
    may_lock_all=False,
    may_raise_others=False,
)


# What the checks look at, whatever the profiles of the day say.
PROFILES: dict[str, dict[str, Any]] = {
    "desktop": {
        "realtime_priority": 40,
        "realtime_required": False,
        "memory_lock": False,
        "power_mode": "",
        "models": {},
    },
    "robot": {
        "name": "robot",
        "realtime_priority": 50,
        "realtime_required": True,
        "memory_lock": True,
        "power_mode": "25W",
        "processes": {"control": ProcessSettings(affinity=(5,), nice=0, threads=1)},
        "models": {
            role: ModelChoice(
                tiers=tiers,
                providers=("CPUExecutionProvider",),
                precision="int8",
                threads=1,
                cpu_fallback=True,
                memory_arena=True,
            )
            for role, tiers in (("detector", ("medium", "small")), ("planner", ("planner_1b",)))
        },
    },
}


@dataclass
class LateClock:
    """Wakes up as late as it is told, one wake-up after the other."""

    late_ns: Callable[[int], int] = lambda _: 0
    time_ns: int = 0
    wake_ups: int = 0

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = deadline_ns + self.late_ns(self.wake_ups)
        self.wake_ups += 1


@dataclass
class Computer:
    """A computer laid out in a folder, whose commands answer what they are told to."""

    root: Path
    answers: dict[str, str] = field(default_factory=dict)

    def write(self, path: str, text: str = "") -> Path:
        file = self.root / path.lstrip("/")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    def ask(self, command: Sequence[str]) -> str:
        if command[0] not in self.answers:
            raise ValueMissing(f"`{command[0]}` is not installed")
        return self.answers[command[0]]

    def context(self, profile: str = "desktop", *, robot: str | None = None) -> DoctorContext:
        return DoctorContext(
            tree=Tree(self.root),
            is_live=True,
            board=identify(self.root),
            profile=replace(load_profile("desktop"), **PROFILES[profile]),
            robot=None if robot is None else load_robot(robot),
            rights=ALL_RIGHTS,
            ask=self.ask,
            clock=LateClock(),
            models=ModelStore(self.root / "added", self.root / "embedded"),
        )


@pytest.fixture
def computer(tmp_path: Path) -> Computer:
    return Computer(tmp_path)


def without_rights(context: DoctorContext) -> DoctorContext:
    return replace(
        context,
        rights=Rights(
            uid=1000,
            fifo_refusal="Operation not permitted",
            realtime_priority_limit=0,
            memory_lock_bytes=8 << 20,
            may_lock_all=False,
            may_raise_others=False,
        ),
    )


@pytest.fixture
def stripped() -> Callable[[DoctorContext], DoctorContext]:
    return without_rights


def one(findings: Sequence[DoctorFinding]) -> DoctorFinding:
    assert len(findings) == 1
    return findings[0]
