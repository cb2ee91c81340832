"""Play named scenes of the suites, score them, and compare with an earlier report."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from sim_twin.campaigns.processes import played
from sim_twin.campaigns.selection import chosen
from sim_twin.campaigns.suites.comparison import compare, read_scored_cases
from sim_twin.campaigns.suites.ray_tasks import played_by_ray
from sim_twin.campaigns.suites.report import ScoredCase, SuiteReport
from sim_twin.campaigns.suites.scenes import ALL, SuiteScene, play, scenes_of

COUNT: Final = 2


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> SuiteReport:
    """Play the cases of `options.suite`; `options.count` seeds of each scene, 2 unless given."""
    count = COUNT if options.count is None else options.count
    seeds = range(options.seed, options.seed + count)
    mine = chosen(scenes_of(options.suite or ALL, seeds), options.only, lambda case: case.name)
    names = [case.name for case in mine]
    earlier = None if options.compare is None else read_scored_cases(options.compare, names)
    report = SuiteReport(campaign="suite", cases=_played(mine, options, tell))
    if earlier is None:
        return report
    return replace(report, comparison=compare(earlier, report.scored, str(options.compare)))


def _played(
    cases: list[SuiteScene], options: argparse.Namespace, tell: Callable[[str], None]
) -> tuple[ScoredCase, ...]:
    if options.ray is not None:
        return played_by_ray(play, cases, options.ray, options.workers, tell)
    return played(play, cases, options.workers, tell, 1)
