from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from platforms import LadderAction, LadderStep, LadderTiming, Profile, load_profile
from platforms.probes import Reading
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import ClaimBook, SharedSpace
from vla_deploy.supervisor.budgets import BudgetKeeper, UsageSnapshot
from vla_deploy.supervisor.budgets.cgroup import CgroupTree
from vla_deploy.supervisor.budgets.emergency import Emergencies
from vla_deploy.supervisor.budgets.enforcement import Enforcer
from vla_deploy.supervisor.processes.usage import Usage


class ScriptedFeed:
    """Hand out what a test says was measured."""

    def __init__(self) -> None:
        self.closed = False
        self.failures = 0
        self.snapshots: list[UsageSnapshot] = []
        self.watched: Mapping[str, int] = {}

    def watch(self, pids: Mapping[str, int]) -> None:
        self.watched = pids

    def latest(self) -> UsageSnapshot | None:
        return self.snapshots[-1] if self.snapshots else None

    def since(self, stamp_ns: int) -> tuple[UsageSnapshot, ...]:
        return tuple(one for one in self.snapshots if one.stamp_ns > stamp_ns)

    def close(self) -> None:
        self.closed = True


class World:
    """Step a keeper twice a second under what processes and board are said to use."""

    def __init__(self, directory: Path, profile: Profile) -> None:
        # No kernel gives out pids like these.
        self.pids = {"control": 2**30, "perception": 2**30 + 1, "planner": 2**30 + 2}
        self.clock = ManualClock(NS_PER_S)
        self.feed = ScriptedFeed()
        self.space = SharedSpace(directory / "ipc", self.clock)
        self.readings: dict[str, float | None] = {}
        self.memory_mb = dict.fromkeys(self.pids, 50.0)
        self.cpu_ratio = dict.fromkeys(self.pids, 0.1)
        self.wall_ratio = 1.0
        """Seconds of the wall clock in one of the run's."""
        self.running = dict(self.pids)
        self.restarted: list[str] = []
        self._cpu_s = dict.fromkeys(self.pids, 0.0)
        self.profile = profile
        self.keeper = BudgetKeeper(
            lambda: self.profile,
            self.space,
            self.clock,
            self.feed,
            Emergencies(lambda: {"tj-thermal": 104.5}),
            Enforcer(CgroupTree(directory)),
            ClaimBook(self.space, self.clock),
        )

    def go(self, seconds: float, *, measured: bool = True) -> None:
        for _ in range(round(2 * seconds)):
            self.clock.ns += NS_PER_S // 2
            if measured:
                self.measure()
            self.restarted += self.keeper.step(self.running)
            suspended = self.keeper.suspended
            self.running = {k: v for k, v in self.pids.items() if k not in suspended}

    def measure(self) -> None:
        self.feed.snapshots.append(self._snapshot())

    def cell(self, name: str) -> dict:
        return self.space.cell_reader(name).latest().document()

    def _snapshot(self) -> UsageSnapshot:
        for name in self.running:
            self._cpu_s[name] += self.cpu_ratio[name] / 2
        return UsageSnapshot(
            stamp_ns=self.clock.ns,
            wall_ns=round(self.wall_ratio * self.clock.ns),
            readings={
                name: Reading(name=name, value=value, unit="", reason="asleep" * (value is None))
                for name, value in self.readings.items()
            },
            usages={
                name: Usage(
                    memory_mb=self.memory_mb[name],
                    rss_mb=self.memory_mb[name],
                    cpu_ratio=0.0,
                    cpu_s=self._cpu_s[name],
                )
                for name in self.running
            },
            pids=dict(self.running),
            peak_memory_mb=sum(self.memory_mb.values()),
            memory_kind="pss",
        )


def step(action: str, process: str = "", ratio: float = 1.0) -> LadderStep:
    return LadderStep(action=LadderAction(action), process=process, ratio=ratio)


@pytest.fixture
def profile() -> Profile:
    base = load_profile("desktop")
    return replace(
        base,
        total=replace(base.total, temperature_c=85.0, power_w=20.0),
        ladder=(
            step("slow", "perception", 0.5),
            step("slow", "perception", 0.25),
            step("smaller_model", "perception"),
            step("suspend", "planner"),
            step("restart", "perception"),
            step("protective_stop"),
        ),
        ladder_timing=LadderTiming(rise_s=2.0, fall_s=4.0, release_ratio=0.8),
    )


@pytest.fixture
def world(tmp_path: Path, profile: Profile) -> Iterator[World]:
    world = World(tmp_path, profile)
    yield world
    world.keeper.close()
    world.space.close()
