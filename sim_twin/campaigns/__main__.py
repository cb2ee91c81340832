"""Run one campaign: `python -m sim_twin.campaigns faults --json`."""

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from sim_twin.campaigns import fault_matrix, kills, pressure, soak, switches
from sim_twin.campaigns.report import Report
from sim_twin.campaigns.selection import NothingChosen

CAMPAIGNS: Final[Mapping[str, Callable[[argparse.Namespace, Callable[[str], None]], Report]]] = {
    "faults": fault_matrix.run,
    "kills": kills.run,
    "pressure": pressure.run,
    "switches": switches.run,
    "soak": soak.run,
}
_EXAMPLES: Final = """examples:
  vla-deploy validate faults --junit out/faults.xml
  vla-deploy validate faults --only servo_bus --json
  vla-deploy validate kills --count 20"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run it; exit code 0 only where no case failed, 2 where `--only` chooses none."""
    options = _parser().parse_args(argv)
    progress = _to_stderr if options.json else _to_stdout
    try:
        report = CAMPAIGNS[options.campaign](options, progress)
    except NothingChosen as error:
        _to_stderr(f"validate {options.campaign}: {error}")
        return 2
    if options.junit is not None:
        report.write_junit(options.junit)
    _to_stdout(json.dumps(report.document(), indent=2) if options.json else report.text())
    return 1 if report.failed else 0


def _to_stdout(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _to_stderr(line: str) -> None:
    sys.stderr.write(line + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="vla-deploy validate",
        description=__doc__,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("campaign", choices=tuple(CAMPAIGNS))
    parser.add_argument("--only", default="", help="play only cases whose name contains this")
    parser.add_argument("--count", type=int, help="how many injections or switches")
    parser.add_argument("--hours", type=float, default=1.0, help="how long to soak")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2, help="how many cases at a time")
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
