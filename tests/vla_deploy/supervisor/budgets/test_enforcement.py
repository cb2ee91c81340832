import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from platforms import ProcessBudget
from vla_deploy.supervisor.budgets.cgroup import CgroupTree
from vla_deploy.supervisor.budgets.enforcement import Enforcer
from vla_deploy.supervisor.budgets.hold_back import CpuHold, HoldRefused
from vla_deploy.supervisor.budgets.judge import BudgetFinding, Line

NAME = "planner"
BUDGETS = {NAME: ProcessBudget(memory_mb=20.0, cpu_ratio=0.5)}
Kept = tuple[int, set[int], tuple[int, int]]


@pytest.fixture
def pid() -> Iterator[int]:
    waiting = "import sys; print('up', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", waiting], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "up\n"
        yield child.pid
        child.kill()


@pytest.fixture
def enforcer(tmp_path: Path) -> Enforcer:
    """Return one that has no control groups."""
    enforcer = Enforcer(CgroupTree(tmp_path))
    enforcer.adopt(BUDGETS)
    return enforcer


def claims(pid: int) -> Kept:
    return (
        os.getpriority(os.PRIO_PROCESS, pid),
        os.sched_getaffinity(pid),
        resource.prlimit(pid, resource.RLIMIT_DATA),
    )


def over(*metrics: str) -> list[BudgetFinding]:
    return [
        BudgetFinding(line=Line(process=NAME, metric=metric, limit=0.5), over=True, measured=1.0)
        for metric in metrics
    ]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may lower nice again")
def test_another_profile_releases_who_is_held_back(enforcer, pid):
    before = claims(pid)
    enforcer.enforce({NAME: pid}, over("cpu_ratio", "memory_mb"))
    held = claims(pid)
    assert len(held[1]) == 1
    assert held[2][0] != before[2][0]
    enforcer.adopt(BUDGETS)
    assert claims(pid) == before
    enforcer.enforce({NAME: pid}, [])
    assert "once it is over" in enforcer.enforced[NAME].cpu
    assert claims(pid) == before


class Stubborn:
    """Refuse to be released so many times."""

    def __init__(self, refusals: int) -> None:
        self.refusals = refusals

    def __str__(self) -> str:
        return "nice 10 and 1 cores"

    def release(self) -> None:
        self.refusals -= 1
        if self.refusals >= 0:
            raise HoldRefused("Operation not permitted")


def test_a_release_that_is_refused_is_tried_again(enforcer, pid, monkeypatch, caplog):
    monkeypatch.setattr(CpuHold, "take", lambda pid, cores: Stubborn(2))
    enforcer.enforce({NAME: pid}, over("cpu_ratio"))
    for _ in range(2):
        enforcer.enforce({NAME: pid}, [])
        assert enforcer.enforced[NAME].cpu == "nice 10 and 1 cores, because Operation not permitted"
    assert len([one for one in caplog.records if "not permitted" in one.message]) == 1
    enforcer.enforce({NAME: pid}, [])
    assert "once it is over" in enforcer.enforced[NAME].cpu


def test_a_hold_that_is_refused_is_tried_again(enforcer, pid, monkeypatch):
    holds: Iterator[HoldRefused | Stubborn] = iter([HoldRefused("no memory"), Stubborn(0)])

    def take(pid: int, cores: float) -> Stubborn:
        found = next(holds)
        if isinstance(found, HoldRefused):
            raise found
        return found

    monkeypatch.setattr(CpuHold, "take", take)
    enforcer.enforce({NAME: pid}, over("cpu_ratio"))
    assert enforcer.enforced[NAME].cpu == "none, because no memory"
    enforcer.enforce({NAME: pid}, over("cpu_ratio"))
    assert enforcer.enforced[NAME].cpu.startswith("nice 10 and 1 cores, because ")
