"""Run one campaign: `python -m sim_twin.campaigns faults --json`."""

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from sim_twin.campaigns import agents, demos, load, missions, navigation, soak
from sim_twin.campaigns.cutting import power_cuts
from sim_twin.campaigns.faulting import fault_matrix
from sim_twin.campaigns.killing import kills
from sim_twin.campaigns.orderly_end import end_on_sigterm
from sim_twin.campaigns.pressing import pressure
from sim_twin.campaigns.report import CampaignReport, make_room
from sim_twin.campaigns.selection import OptionRefused
from sim_twin.campaigns.stopping import stops
from sim_twin.campaigns.stopping.report import StopReport
from sim_twin.campaigns.suites import suite
from sim_twin.campaigns.suites.page import write_page
from sim_twin.campaigns.suites.ray_tasks import LOCAL
from sim_twin.campaigns.suites.report import SuiteReport
from sim_twin.campaigns.switching import switches
from vla_deploy.cli.commands import OneLineParser, number_above_zero, whole_number
from vla_deploy.cli.maintenance.measure import SUITES

CAMPAIGNS: Final[
    Mapping[str, Callable[[argparse.Namespace, Callable[[str], None]], CampaignReport]]
] = {
    "agents": agents.run,
    "demos": demos.run,
    "faults": fault_matrix.run,
    "kills": kills.run,
    "load": load.run,
    "missions": missions.run,
    "navigation": navigation.run,
    "power-cuts": power_cuts.run,
    "pressure": pressure.run,
    "switches": switches.run,
    "soak": soak.run,
    "stops": stops.run,
    "suite": suite.run,
}
_EXAMPLES: Final = """examples:
  vla-deploy validate faults --junit out/faults.xml
  vla-deploy validate faults --only servo_bus --json
  vla-deploy validate kills --count 20
  vla-deploy validate demos --robot so101
  vla-deploy validate stops --short --report out
  vla-deploy validate suite safety --count 1 --html out/safety.html"""
_EXIT_INTERRUPTED: Final = 130
_WORKERS: Final = 2
_FILES: Final = ("junit", "html")
_OF_SUITES: Final = ("suite", "html", "compare", "ray")
_OF_STOPS: Final = ("short", "report")


def main(argv: Sequence[str] | None = None) -> int:
    """Run it; exit code 0 only where no case failed, 2 where the options cannot be met."""
    options = _options(argv)
    progress = _to_stderr if options.json else _to_stdout
    try:
        for option in _FILES:
            if (path := getattr(options, option)) is not None:
                make_room(f"--{option}", path)
        if options.report is not None:
            make_room("--report", options.report / "stops.html")
        report = CAMPAIGNS[options.campaign](options, progress)
    except OptionRefused as error:
        _to_stderr(f"validate {options.campaign}: {error}")
        return 2
    except KeyboardInterrupt:
        return _EXIT_INTERRUPTED
    _to_stdout(json.dumps(report.document(), indent=2) if options.json else report.text())
    if options.junit is not None:
        report.write_junit(options.junit)
    if options.html is not None and isinstance(report, SuiteReport):
        write_page(report, options.html)
    if options.report is not None and isinstance(report, StopReport):
        report.write(options.report)
    return 0 if report.passed else 1


def _options(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return the options; those of the suites belong to no other campaign."""
    parser = _parser()
    options = parser.parse_args(argv)
    if options.campaign != "suite":
        for option in _OF_SUITES:
            if getattr(options, option) is not None:
                name = "a suite's name" if option == "suite" else f"--{option}"
                parser.error(f"{name} is of `validate suite`, not of `validate {options.campaign}`")
    if options.campaign != "stops":
        for option in _OF_STOPS:
            if getattr(options, option):
                parser.error(f"--{option} is of `validate stops`, not of {options.campaign}")
    if options.workers is None:
        options.workers = (os.cpu_count() or 1) if options.campaign == "suite" else _WORKERS
    return options


def start(argv: Sequence[str] | None = None) -> int:
    """Run it as a process of its own, which SIGTERM ends in order."""
    end_on_sigterm()
    return main(argv)


def _to_stdout(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _to_stderr(line: str) -> None:
    sys.stderr.write(line + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="vla-deploy validate",
        description=__doc__,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("campaign", choices=tuple(CAMPAIGNS))
    parser.add_argument("suite", nargs="?", choices=tuple(SUITES), help="of suite (default: all)")
    parser.add_argument("--only", default="", help="play only cases whose name contains this")
    parser.add_argument(
        "--count", type=whole_number(), help="how many injections, switches, or stops"
    )
    parser.add_argument(
        "--hours", type=number_above_zero("hours"), default=1.0, help="how long to soak"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="butler", help="of demos, faults, kills, load and stops")
    parser.add_argument(
        "--workers",
        type=whole_number(),
        help=f"how many cases at a time (default: {_WORKERS}; of suite: one a core)",
    )
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    parser.add_argument("--html", type=Path, metavar="FILE", help="of suite: write a page too")
    parser.add_argument(
        "--compare", type=Path, metavar="FILE", help="of suite: compare with what --json printed"
    )
    parser.add_argument(
        "--ray", nargs="?", const=LOCAL, metavar="ADDRESS", help="of suite: play on a Ray cluster"
    )
    parser.add_argument("--short", action="store_true", help="of stops: a minute's worth of cells")
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="of stops: write a page, JSON and a table there"
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


if __name__ == "__main__":
    sys.exit(start())
