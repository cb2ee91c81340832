"""Measure how well, how safely and how fast the robot understands commands, in one run.

Each part is a module of its own and may be run alone. `commands`, `off_domain` and `attacks` play
the corpora of `benchmarks/corpora` with the robot's own planner node and judge its plans in a world
of symbols that shares no code with the robot; docs/validation.md says how. `live` is measured on
the real processes and the twin.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Final

from benchmarks.command import parser, show

PARTS: Final[Mapping[str, str]] = {
    "commands": "commands whose plans reach their goal, time to the plan; by kind, by rung",
    "off_domain": "other talk that is rejected or asked back",
    "attacks": "unsafe plans accepted of adversarial commands, scenes and plans",
    "live": "from a typed or spoken command to the first motion, memory, in the real processes",
}


def measure(parts: Sequence[str], options: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the figures of some parts, each measured with its options."""
    report: dict[str, Any] = {"parts": list(parts)}
    for part in parts:
        report |= import_module(f"benchmarks.planner_{part}").measure(**options.get(part, {}))
    return report


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("planner", __doc__)
    listed = "; ".join(f"{name}: {summary}" for name, summary in PARTS.items())
    arguments.add_argument(
        "--part", action="append", choices=sorted(PARTS), help=f"all unless told: {listed}"
    )
    arguments.add_argument("--misses", action="store_true", help="list what went wrong")
    arguments.add_argument("--rounds", type=int, default=1, help="of live commands")
    given = arguments.parse_args(argv)
    judged = {name: {"misses": given.misses} for name in ("commands", "off_domain", "attacks")}
    options = judged | {"live": {"rounds": given.rounds}}
    show(measure(given.part or list(PARTS), options), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
