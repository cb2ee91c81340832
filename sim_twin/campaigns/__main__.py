"""Run one campaign: `python -m sim_twin.campaigns faults --json`."""

import argparse
import json
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
from sim_twin.campaigns.report import CampaignReport, NoRoom, make_room
from sim_twin.campaigns.selection import NothingChosen
from sim_twin.campaigns.switching import switches
from vla_deploy.cli.commands import OneLineParser, number_above_zero, whole_number

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
}
_EXAMPLES: Final = """examples:
  vla-deploy validate faults --junit out/faults.xml
  vla-deploy validate faults --only servo_bus --json
  vla-deploy validate kills --count 20
  vla-deploy validate demos --robot so101"""
_EXIT_INTERRUPTED: Final = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run it; exit code 0 only where no case failed, 2 where the options cannot be met."""
    options = _parser().parse_args(argv)
    progress = _to_stderr if options.json else _to_stdout
    try:
        if options.junit is not None:
            make_room(options.junit)
        report = CAMPAIGNS[options.campaign](options, progress)
    except (NothingChosen, NoRoom) as error:
        _to_stderr(f"validate {options.campaign}: {error}")
        return 2
    except KeyboardInterrupt:
        return _EXIT_INTERRUPTED
    _to_stdout(json.dumps(report.document(), indent=2) if options.json else report.text())
    if options.junit is not None:
        report.write_junit(options.junit)
    return 1 if report.failed else 0


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
    parser.add_argument("--only", default="", help="play only cases whose name contains this")
    parser.add_argument("--count", type=whole_number(), help="how many injections or switches")
    parser.add_argument(
        "--hours", type=number_above_zero("hours"), default=1.0, help="how long to soak"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="butler", help="of demos, faults, kills and load")
    parser.add_argument(
        "--workers", type=whole_number(), default=2, help="how many cases at a time"
    )
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


if __name__ == "__main__":
    sys.exit(start())
