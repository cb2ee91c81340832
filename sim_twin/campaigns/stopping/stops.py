"""Certify the stops: every source in every phase, judged by physics, and timed to the wire."""

import argparse
import signal
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, Final

from sim_twin.campaigns.killing.kills import inject_all
from sim_twin.campaigns.killing.rules import RULES, Injection
from sim_twin.campaigns.processes import played
from sim_twin.campaigns.report import CampaignCase, told
from sim_twin.campaigns.selection import chosen
from sim_twin.campaigns.stopping import stop_latencies, stop_trials
from sim_twin.campaigns.stopping.cells import (
    NOT_TRIED,
    SHORT,
    StopCell,
    WallCell,
    cells,
    wall_cells,
)
from sim_twin.campaigns.stopping.report import StopReport

COUNT: Final = 100
SHORT_COUNT: Final = 3
_CELLS_PER_PROCESS: Final = 4
_KILL_AFTER_S: Final = 2.0


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> StopReport:
    """Play every cell whose name contains `options.only`, `options.count` stops in each.

    The wall clock's cells and the kills come last, one after the other: they want the computer.
    """
    mine = chosen(_every(), options.only, lambda cell: cell.name)
    if options.short:
        mine = [cell for cell in mine if cell.name in SHORT]
    count = options.count or (SHORT_COUNT if options.short else COUNT)
    play = partial(stop_trials.play, seed=options.seed, count=count, robot=options.robot)
    stops = [cell for cell in mine if isinstance(cell, StopCell)]
    cases: list[CampaignCase] = []
    if stops:
        cases += played(play, stops, options.workers, tell, _CELLS_PER_PROCESS)
    walls = [cell for cell in mine if isinstance(cell, WallCell)]
    cases += [told(case, tell) for case in stop_latencies.play_all(walls, options.seed, count)]
    killed = [cell for cell in mine if isinstance(cell, Injection)]
    if killed:
        cases += inject_all(killed, options.seed, tell, 1, options.robot).cases
    cases += _not_played(mine, options)
    return StopReport(
        campaign="stops",
        cases=tuple(cases),
        summary=_summary(cases),
        command=_command(options, count),
        robot=options.robot,
        seed=options.seed,
    )


def _every() -> Iterator[StopCell | WallCell | Injection]:
    yield from cells()
    yield from wall_cells()
    for number, (process, what) in enumerate(RULES):
        if what is signal.SIGKILL:
            yield Injection(number=number, process=process, signal=what, after_s=_KILL_AFTER_S)


def _not_played(
    mine: Sequence[StopCell | WallCell | Injection], options: argparse.Namespace
) -> Iterator[CampaignCase]:
    """Return what this form leaves out, and what no form plays: none of it has passed."""
    if not options.only:
        names = {cell.name for cell in mine}
        for cell in _every():
            if cell.name not in names:
                yield CampaignCase(name=cell.name, skipped="not tried in the short form")
        for name, why in NOT_TRIED.items():
            yield CampaignCase(name=name, skipped=f"not tried here: {why}")


def _summary(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    stops = [case for case in cases if "physics" in case.figures]
    longest = [case.figures["standstill_s_max"] for case in stops]
    wired = [case.figures["to_wire_s_max"] for case in cases if "to_wire_s_max" in case.figures]
    return {
        "stops": sum(case.figures["n"] for case in stops),
        "cells_verified": sum(not (case.failures or case.skipped) for case in cases),
        "cells_failed": sum(bool(case.failures) for case in cases),
        "cells_not_tried": sum(bool(case.skipped) for case in cases),
        "longest_standstill_s": max((one for one in longest if one is not None), default=None),
        "longest_to_wire_s": max((one for one in wired if one is not None), default=None),
    }


def _command(options: argparse.Namespace, count: int) -> str:
    words = [f"--count {count}", f"--seed {options.seed}", f"--robot {options.robot}"]
    words = ["--short", *words] if options.short else words
    words += [f"--only {options.only}"] if options.only else []
    return " ".join(["vla-deploy validate stops", *words, "--report DIR"])
