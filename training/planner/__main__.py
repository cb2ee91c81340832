"""Run one step, or all: python -m training.planner all --out /data/planner."""

import argparse
import logging
from collections.abc import Callable
from pathlib import Path

import torch

from training.planner.chatter import read_chatter
from training.planner.settings import SIZES, Settings
from training.planner.training import train

_EXAMPLE = (
    "example: nice python -m training.planner all --out /data/planner --chatter data_full.json"
)
Step = Callable[[argparse.Namespace, Settings], None]


def main() -> None:
    """Parse the command line and run the steps."""
    parser = argparse.ArgumentParser(
        prog="python -m training.planner", description=__doc__, epilog=_EXAMPLE
    )
    parser.add_argument("step", choices=[*STEPS, "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for states and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument("--threads", type=int, default=1, help="of the training (default: 1)")
    parser.add_argument(
        "--chatter", type=Path, metavar="FILE", help="data_full.json of CLINC150: other talk"
    )
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    torch.set_num_threads(arguments.threads)
    for name in STEPS if arguments.step == "all" else [arguments.step]:
        STEPS[name](arguments, SIZES[arguments.size])


def _train(arguments: argparse.Namespace, settings: Settings) -> None:
    chatter = read_chatter(arguments.chatter) if arguments.chatter else ()
    train(arguments.out, settings, chatter)


STEPS: dict[str, Step] = {"train": _train}

if __name__ == "__main__":
    main()
