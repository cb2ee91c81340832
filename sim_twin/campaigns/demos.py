"""Do the job of `vla-deploy demo` in one random scene after the other: physics judges each."""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median
from typing import Any, Final

from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure, told
from sim_twin.harness.robot import VLA_DEPLOY

COUNT: Final = 10
_LONGEST_S: Final = 3600.0
_NONE_OF: Final = ("late_ticks", "bus_timeouts")

Outcome = Mapping[str, Any]


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Do the job of `options.robot` with `options.count` seeds, 10 unless given, as text."""
    count = COUNT if options.count is None else options.count
    seeds = range(options.seed, options.seed + count)
    cases = [told(play(seed, options.robot), tell) for seed in seeds]
    return CampaignReport(campaign="demos", cases=tuple(cases), summary=_summary(cases))


def play_demo(seed: int, robot: str, *more: str) -> Outcome:
    """Run `vla-deploy demo` as a new user does, on a runtime directory that remembers nothing."""
    with tempfile.TemporaryDirectory(prefix="vla-demo-") as folder:
        base, out = Path(folder) / "base", Path(folder) / "out"
        words = ["--runtime-base", str(base), "demo", "--json", "--seed", str(seed)]
        done = subprocess.run(
            [*VLA_DEPLOY, *words, "--robot", robot, "--out", str(out), *more],
            capture_output=True,
            text=True,
            timeout=_LONGEST_S,
            check=False,
        )
    try:
        outcome: Outcome = json.loads(done.stdout)
    except json.JSONDecodeError:
        error = done.stderr.strip() or f"exit code {done.returncode}"
        return {"success": False, "error": error, "actions": [], "placement_error_m": None}
    return outcome


def faults_of(outcome: Outcome) -> list[str]:
    """Return what was wrong with one run: the job, the control loop, the buses."""
    faults = [] if outcome["success"] else [f"failed: {outcome['error'] or outcome['refused']}"]
    counted = (what for what in _NONE_OF if outcome.get(what))
    return faults + [f"{what}: {outcome[what]}, expected 0" for what in counted]


@crash_is_failure
def play(seed: int, robot: str) -> CampaignCase:
    """Do the job of a robot with a seed and judge it."""
    outcome = play_demo(seed, robot, "--typed", "--fast", "--headless")
    names = ("took_s", "wall_s", "placement_error_m", "pushes")
    return CampaignCase(
        name=f"{robot}/{seed}",
        failures=tuple(faults_of(outcome)),
        figures={what: outcome.get(what) for what in names},
        seconds=float(outcome.get("wall_s") or 0.0),
    )


def _summary(cases: list[CampaignCase]) -> dict[str, Any]:
    errors_m = [one for case in cases if (one := case.figures["placement_error_m"]) is not None]
    took_s = [case.figures["took_s"] for case in cases if case.figures["took_s"]]
    return {
        "done": sum(not case.failures for case in cases),
        "median_placement_error_m": median(errors_m) if errors_m else None,
        "median_took_s": median(took_s) if took_s else None,
    }
