"""Measure how well, how soon and at what cost the robot understands speech, in one run.

Each part is a module of its own and may be run alone. `words` gives the figures of the whole: word
errors of the shipped recogniser on sentences, voices and an engine that its training never had,
quiet and in noise, what it is sure of, and what reading costs. The other parts lie each below its
own name.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Final

from benchmarks.command import parser, show

OWN: Final = ("words",)
PARTS: Final[Mapping[str, str]] = {
    "words": "word errors by voice and noise, sureness, other talk, time per phrase",
    "plans": "spoken commands that give the plan of the typed ones; other talk that gives none",
    "voice": "whether the robot hears itself, and how soon a person silences it",
    "ears": "where phrases begin and end, from the end of speech to the text, other sound",
    "stop": "stop words missed by noise and voice, false alarms, from the word to the latch",
}


def measure(parts: Sequence[str], options: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the figures of some parts, each measured with its options."""
    report: dict[str, Any] = {"parts": list(parts)}
    for part in parts:
        figures = import_module(f"benchmarks.speech_{part}").measure(**options.get(part, {}))
        report |= figures if part in OWN else {part: figures}
    return report


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech", __doc__)
    listed = "; ".join(f"{name}: {summary}" for name, summary in PARTS.items())
    arguments.add_argument(
        "--part", action="append", choices=sorted(PARTS), help=f"all unless told: {listed}"
    )
    arguments.add_argument("--sentences", type=int, default=150, help="of each set of words")
    arguments.add_argument("--seed", type=int, default=0, help="of voices and noise")
    given = arguments.parse_args(argv)
    options = {"words": {"sentences": given.sentences, "seed": given.seed}}
    show(measure(given.part or list(PARTS), options), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
