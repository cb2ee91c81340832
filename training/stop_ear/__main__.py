"""Run one step, or all: python -m training.stop_ear all --out /data/stop_ear.

`speak` says the clips that `training.stop_words` learns from; those that are there already stay.
`mean` makes one of two that have gone on from the same weights with other seeds: it is better than
either. `ship --with` has two of different trainings heard side by side, and the mean of both told.
"""

import argparse
import logging
import os
from pathlib import Path
from typing import Final

from training.speech.shipping import SHIPPED

CLIPS: Final = "clips"
STEPS: Final = ("speak", "train", "ship")


def main() -> None:
    """Parse the command line and run the steps."""
    # Threads that wait for each other at barriers cost more than they bring on a busy computer.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    parser = argparse.ArgumentParser(
        prog="python -m training.stop_ear",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="example: nice python -m training.stop_ear all --out /data/stop_ear",
    )
    parser.add_argument("step", choices=[*STEPS, "mean", "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for clips and weights")
    parser.add_argument(
        "--talk", type=Path, help="clips of `training.speech data`, as more of other talk"
    )
    parser.add_argument("--minutes", type=float, default=25.0, help="of learning (default: 25)")
    parser.add_argument("--seed", type=int, default=22)
    parser.add_argument("--scale", type=float, default=1.0, help="share of the clips (default: 1)")
    parser.add_argument(
        "--recogniser", type=Path, default=SHIPPED,
        help="folder of the recogniser that it is for (default: the one that is shipped)",
    )  # fmt: skip
    parser.add_argument("--start-from", type=Path, help="a shipped ear to go on from")
    parser.add_argument(
        "--with", dest="other", type=Path, help="of `mean`, `ship`: the other training"
    )
    parser.add_argument("--into", type=Path, help="of `mean`: the folder for the mean of both")
    given = parser.parse_args()
    if given.step == "mean" and None in (given.other, given.into):
        parser.error("mean: expected --with OTHER and --into NEW")
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    for step in STEPS if given.step == "all" else (given.step,):
        _run(step, given)


# What a step needs beyond numpy is imported by that step alone.
def _run(step: str, given: argparse.Namespace) -> None:
    clips = given.out / CLIPS
    if step == "speak":
        from training.stop_words.corpus import speak

        speak(clips, given.seed, given.scale)
    elif step == "train":
        from training.stop_ear.training import train

        train(
            clips, given.talk, given.recogniser, given.out, given.minutes, given.seed,
            given.start_from,
        )  # fmt: skip
    elif step == "mean":
        from training.stop_ear.training import mean

        mean(given.out, given.other, given.into)
    else:
        from training.stop_ear.export import ship

        ship([one for one in (given.out, given.other) if one is not None], given.recogniser)


if __name__ == "__main__":
    main()
