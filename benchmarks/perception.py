"""Measure how well, how fast and at what cost the robot sees, in one run.

Each part is a module of its own and may be run alone. `network` and `live` give the figures of the
whole: accuracy of the shipped files on freshly drawn images that training never saw, int8 beside
fp32, and the real processes on the twin, under the profile of the smallest board. The other parts
lie each below its own name.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Final

from benchmarks.command import parser, show

OWN: Final = ("network", "live")
PARTS: Final[Mapping[str, str]] = {
    "network": "accuracy of the shipped files, int8 beside fp32, names by form and by both",
    "live": "from the camera's image to the scene, CPU and memory, in the real processes",
    "geometry": "where things are told to be, against the truth",
    "map": "pose after a tour, finding itself again, the map that it draws",
    "tracks": "ids kept and found again, relations against the truth, CPU of the tracker",
}


def measure(parts: Sequence[str], options: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the figures of some parts, each measured with its options."""
    report: dict[str, Any] = {"parts": list(parts)}
    for part in parts:
        figures = import_module(f"benchmarks.perception_{part}").measure(**options.get(part, {}))
        report |= figures if part in OWN else {part: figures}
    return report


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("perception", __doc__)
    listed = "; ".join(f"{name}: {summary}" for name, summary in PARTS.items())
    arguments.add_argument(
        "--part", action="append", choices=sorted(PARTS), help=f"all unless told: {listed}"
    )
    arguments.add_argument("--images", type=int, default=100, help="to judge accuracy by")
    arguments.add_argument("--scenes", type=int, default=48, help="to judge names by")
    arguments.add_argument("--seconds", type=float, default=40.0, help="of the live robot")
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    options = {
        "network": {"images": given.images, "scenes": given.scenes, "seed": given.seed},
        "live": {"seconds": given.seconds},
        "geometry": {"seed": given.seed},
        "tracks": {"seed": given.seed},
    }
    show(measure(given.part or list(PARTS), options), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
