"""Do the main job beside busy loops: it may take longer, and nothing else may change."""

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from statistics import median
from typing import Any, Final

from sim_twin.campaigns.demos import Outcome, faults_of, play_demo
from sim_twin.campaigns.report import CampaignCase, CampaignReport, told

BUSY_LOOPS: Final = 8
COUNT: Final = 10
MOST_APART_M: Final = 0.001
_SPIN: Final = "while True: pass"


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Do the job once alone, then `options.count` times beside busy loops, 10 unless given."""
    count = COUNT if options.count is None else options.count
    alone = play_demo(options.seed, options.robot)
    cases = [told(judge("alone", alone, alone), tell)]
    with _busy_loops(BUSY_LOOPS):
        for number in range(count):
            case = judge(
                f"beside_{BUSY_LOOPS}_loops/{number}", play_demo(options.seed, options.robot), alone
            )
            cases.append(told(case, tell))
    return CampaignReport(campaign="load", cases=tuple(cases), summary=_summary(cases[1:]))


def judge(name: str, outcome: Outcome, alone: Outcome) -> CampaignCase:
    """Return the verdict on one run by the one that had the computer for itself."""
    failures = faults_of(outcome)
    if _skills(outcome) != _skills(alone):
        failures.append(f"did {_skills(outcome)}, alone {_skills(alone)}")
    apart_m = _apart_m(outcome, alone)
    if apart_m > MOST_APART_M:
        failures.append(f"placed {1000 * apart_m:.1f} mm from where it did alone")
    if outcome.get("wire_digest") != alone.get("wire_digest"):
        failures.append("other bytes on the buses than alone")
    names = ("took_s", "wall_s", "ticks", "placement_error_m", "wire_digest")
    return CampaignCase(
        name=name,
        failures=tuple(failures),
        figures={what: outcome.get(what) for what in names},
        seconds=float(outcome.get("wall_s") or 0.0),
    )


def _skills(outcome: Outcome) -> list[str]:
    return [f"{one['skill']} {one['status']}" for one in outcome["actions"]]


def _apart_m(outcome: Outcome, alone: Outcome) -> float:
    places = outcome["placement_error_m"], alone["placement_error_m"]
    return 0.0 if None in places else abs(places[0] - places[1])


def _summary(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    ratios = [case.figures["took_s"] / case.figures["wall_s"] for case in cases if case.seconds]
    return {
        "failed": sum(bool(case.failures) for case in cases),
        "median_real_time_ratio": median(ratios) if ratios else None,
        "least_real_time_ratio": min(ratios, default=None),
    }


@contextmanager
def _busy_loops(count: int) -> Iterator[None]:
    """Keep so many loops at the same priority as the robot's processes."""
    loops = [subprocess.Popen([sys.executable, "-c", _SPIN]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
