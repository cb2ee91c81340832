"""Work for hours in lock-step and measure what grows: memory, open files, threads, files."""

import argparse
import os
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import psutil

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.growth import slope, warm
from sim_twin.campaigns.report import CampaignCase, CampaignReport
from sim_twin.campaigns.selection import chosen
from sim_twin.harness.lockstep_stack import LockstepStack
from sim_twin.harness.robot import RobotFailed
from vla_deploy.runtime.malloc_tuning import give_large_blocks_back

MOST_MIB_PER_H: Final = 1.0
LEAST_JOBS_RATIO: Final = 0.8
"""So many jobs must end well: a robot that is stuck at the first one grows by nothing either."""
_SMALL_BLOCK_BYTES: Final = 1024
_BLOCKS_KEPT: Final = 7
"""numpy keeps so many freed blocks of each size below for the next array (NBUCKETS and NCACHE in
its `alloc.c`): 3.5 MiB in all, which a robot that works fills up over hours, size by size."""
_LEAST_SAMPLES: Final = 8
_S_PER_H: Final = 3600.0
_MIB: Final = 1 << 20
_IDLE_S: Final = 20.0
# The longest skill, to search the flat, may take 300 s by itself.
_JOB_S: Final = 900.0
_MUST_NOT_GROW: Final = ("open_files", "threads", "run_files", "run_mib")
JOBS: Final = (
    "pick up the red cup and put it in the box",
    "go to the kitchen",
    "look left",
    "go to the charging station",
    "pick up the red cup and put it on the coffee table",
    "turn around",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SoakSample:
    """Hold what the process has, at a moment of the wall clock and of the simulation.

    `memory_mib` is its own memory. What it maps of files is not in it: pages of topics come into
    use one by one, and the size of their files, `run_mib`, bounds them.
    """

    wall_h: float
    sim_h: float
    memory_mib: float
    open_files: int
    threads: int
    run_files: int
    run_mib: float


class Soak:
    """Own one robot and let it work."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder = folder
        self._clock = MonotonicClock()
        self._process = psutil.Process()
        self.stack = LockstepStack(folder, seed)
        try:
            self.stack.arm()
        except BaseException:
            self.stack.close()
            raise
        self._began_ns = self._clock.now_ns()
        self._began_s = self.stack.lockstep.now_s
        self.done = 0
        self.stopped = 0
        self.failed: list[str] = []

    def work(self, hours: float, tell: Callable[[str], None]) -> list[SoakSample]:
        """Do job after job for so long on the wall clock, and take a sample after each."""
        samples: list[SoakSample] = []
        while not samples or samples[-1].wall_h < hours:
            self.do(JOBS[self.done % len(JOBS)])
            samples.append(self._sample())
            tell(_row(self.done, samples[-1]))
        return samples

    def close(self) -> None:
        """End the robot."""
        self.stack.close()

    def do(self, job: str) -> None:
        """Have one job done, and note how it ended; a robot that stopped is let go on after it."""
        try:
            outcome = self.stack.say(job, _JOB_S)
        except RobotFailed as error:
            self.stack.give(cancel=True)
            outcome = {"error": str(error)}
        self.stack.events.clear()
        self.done += 1
        if not outcome.get("success"):
            self.failed.append(f"{job}: {outcome.get('error') or outcome.get('reason')}")
        self.stack.lockstep.run_for(_IDLE_S)
        self._stand_by()

    def _stand_by(self) -> None:
        """Be the person that a stop wants: see to it, and let the robot go on."""
        if self.stack.status()["state"] != "armed":
            self.stopped += 1
            self.stack.arm()

    def _sample(self) -> SoakSample:
        memory = self._process.memory_info()
        files = [Path(root, name) for root, _, names in os.walk(self._folder) for name in names]
        return SoakSample(
            wall_h=(self._clock.now_ns() - self._began_ns) / NS_PER_S / _S_PER_H,
            sim_h=(self.stack.lockstep.now_s - self._began_s) / _S_PER_H,
            memory_mib=(memory.rss - memory.shared) / _MIB,
            open_files=self._process.num_fds(),
            threads=threading.active_count(),
            run_files=len(files),
            run_mib=sum(file.stat().st_size for file in files) / _MIB,
        )


def fill_cache_of_small_arrays() -> None:
    """Have numpy keep all the small blocks that it ever will: what grows after that is no cache."""
    for size_bytes in range(1, _SMALL_BLOCK_BYTES):
        held = [np.empty(size_bytes, np.uint8) for _ in range(_BLOCKS_KEPT)]
        del held


def growth(samples: Sequence[SoakSample], field: str, per: str = "sim_h") -> float:
    """Return the slope of a figure after the warm-up, per hour.

    Raises:
        ValueError: there are too few samples to tell.
    """
    too_few = _too_few(samples)
    if too_few:
        raise ValueError(too_few)
    judged = warm(samples)
    hours = [getattr(sample, per) for sample in judged]
    return slope(hours, [getattr(sample, field) for sample in judged])


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Work for `options.hours`, one unless told otherwise.

    Raises:
        NothingChosen: `options.only` is part of no case's name.
    """
    names = chosen((*_MUST_NOT_GROW, "memory", "jobs"), options.only, str)
    give_large_blocks_back()  # as every process of the robot does
    fill_cache_of_small_arrays()
    with (
        tempfile.TemporaryDirectory(prefix="vla-soak-") as folder,
        closing(Soak(Path(folder), options.seed)) as soak,
    ):
        samples = soak.work(options.hours, tell)
    cases = (*judge(samples), jobs_case(soak.done, len(soak.failed)))
    mine = tuple(case for case in cases if case.name in names)
    return CampaignReport(campaign="soak", cases=mine, summary=_summary(soak, samples))


def judge(samples: Sequence[SoakSample]) -> tuple[CampaignCase, ...]:
    """Return a case for each thing that must not grow; too short a soak cannot judge them."""
    too_few = _too_few(samples)
    if too_few:
        return tuple(
            CampaignCase(name=name, skipped=too_few) for name in ("memory", *_MUST_NOT_GROW)
        )
    mib_per_h = growth(samples, "memory_mib")
    too_much = (f"grows by {mib_per_h:.2f} MiB/h, limit {MOST_MIB_PER_H:g}",)
    cases = [
        CampaignCase(
            name="memory",
            failures=too_much if mib_per_h > MOST_MIB_PER_H else (),
            figures={
                "mib_per_sim_h": mib_per_h,
                "mib_per_wall_h": growth(samples, "memory_mib", "wall_h"),
            },
        )
    ]
    begin = warm(samples)[0]
    for field in _MUST_NOT_GROW:
        first, last = getattr(begin, field), getattr(samples[-1], field)
        grown = (f"grew from {first} to {last}",) if last > first else ()
        cases.append(
            CampaignCase(name=field, failures=grown, figures={"first": first, "last": last})
        )
    return tuple(cases)


def _too_few(samples: Sequence[SoakSample]) -> str:
    """Return why the samples say nothing of growth, empty where they are enough."""
    count = len(warm(samples))
    enough = count >= _LEAST_SAMPLES
    return "" if enough else f"{count} samples after the warm-up, expected {_LEAST_SAMPLES}"


def jobs_case(done: int, failed: int) -> CampaignCase:
    """Return the verdict about the work itself."""
    ratio = (done - failed) / done if done else 0.0
    failures = (
        (f"{ratio:.0%} of {done} jobs ended well, expected {LEAST_JOBS_RATIO:.0%} at least",)
        if ratio < LEAST_JOBS_RATIO
        else ()
    )
    figures = {"done": done, "failed": failed, "ended_well_ratio": ratio}
    return CampaignCase(name="jobs", failures=failures, figures=figures)


def _summary(soak: Soak, samples: Sequence[SoakSample]) -> dict[str, Any]:
    return {
        "wall_h": samples[-1].wall_h,
        "sim_h": samples[-1].sim_h,
        "jobs": soak.done,
        "jobs_failed": len(soak.failed),
        "stops_that_wanted_a_person": soak.stopped,
        "jobs_ended_well_per_wall_h": (soak.done - len(soak.failed)) / samples[-1].wall_h,
        "jobs_ended_well_per_sim_h": (soak.done - len(soak.failed)) / samples[-1].sim_h,
        "why_jobs_failed": sorted(set(soak.failed)),
    }


def _row(number: int, sample: SoakSample) -> str:
    return (
        f"job {number}: {sample.sim_h:.3f} h simulated, {sample.memory_mib:.1f} MiB, "
        f"{sample.open_files} files open, {sample.threads} threads, "
        f"{sample.run_files} files of {sample.run_mib:.1f} MiB"
    )
