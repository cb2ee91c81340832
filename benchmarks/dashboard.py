"""Measure the dashboard on a running robot, in one run.

Each part is a module of its own and may be run alone; its figures lie below its own name.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Final

from benchmarks.command import parser, show

PARTS: Final[Mapping[str, str]] = {
    "clients": "what fifty clients, one of them frozen, cost control and the dashboard",
    "stop": "from the page's stop to the wire: under load, dashboard blocked, dashboard killed",
}


def measure(parts: Sequence[str], options: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the figures of some parts, each measured with its options."""
    figures = {
        part: import_module(f"benchmarks.dashboard_{part}").measure(**options.get(part, {}))
        for part in parts
    }
    return {"parts": list(parts), **figures}


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("dashboard", __doc__)
    listed = "; ".join(f"{name}: {summary}" for name, summary in PARTS.items())
    arguments.add_argument(
        "--part", action="append", choices=sorted(PARTS), help=f"all unless told: {listed}"
    )
    arguments.add_argument("--seconds", type=float, default=60.0, help="of each view of clients")
    arguments.add_argument("--presses", type=int, default=100, help="of the page's stop")
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    options = {
        "clients": {"seconds": given.seconds},
        "stop": {"requests": given.presses, "seed": given.seed},
    }
    show(measure(given.part or list(PARTS), options), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
