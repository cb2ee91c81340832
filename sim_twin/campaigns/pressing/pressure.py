"""Take memory, CPU, disk, cooling and power away from a working robot, and let its clock jump.

The steps of the ladder must be taken in their order and be undone, control must not be late because
of them, nothing may stop or end but what is declared, and the robot must come back by itself.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from typing import Any

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.campaigns.pressing.judge import judge, listed
from sim_twin.campaigns.pressing.pressed_scene import CannotPress, PressedScene
from sim_twin.campaigns.pressing.trial import PressureTrial
from sim_twin.campaigns.pressing.troubles import TROUBLES, Trouble
from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure, told
from sim_twin.campaigns.selection import chosen


@crash_is_failure
def play(trouble: Trouble, seed: int) -> CampaignCase:
    """Give one trouble to a robot of its own and judge what follows."""
    clock = MonotonicClock()
    began_ns = clock.now_ns()
    wants = {"small_disk": trouble.small_disk, "shifted_clock": trouble.shifted_clock}
    try:
        with PressedScene(seed, **wants) as scene:
            seen = PressureTrial(trouble, scene).run()
    except CannotPress as error:
        return CampaignCase(name=trouble.name, skipped=str(error))
    figures = {
        "late_ratio_before": seen.before.late_ratio,
        "late_ratio_during": seen.during.late_ratio,
        "late_ratio_after": seen.after.late_ratio,
        "steps": listed(seen.taken),
        "steps_s": seen.steps_s,
        "service_s": seen.service_s,
    }
    seconds = (clock.now_ns() - began_ns) / NS_PER_S
    failures = tuple(judge(trouble, seen))
    return CampaignCase(name=trouble.name, failures=failures, figures=figures, seconds=seconds)


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Play every trouble whose name contains `options.only`, one after the other."""
    troubles = chosen(TROUBLES, options.only, lambda trouble: trouble.name)
    cases = [told(play(trouble, options.seed), tell) for trouble in troubles]
    return CampaignReport(campaign="pressure", cases=tuple(cases), summary=_summary(cases))


def _summary(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    times = [float(case.figures["service_s"]) for case in cases if "service_s" in case.figures]
    return {"longest_way_to_full_service_s": max(times, default=math.nan)}
