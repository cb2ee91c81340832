"""Run one step, or all: python -m training.detector all --out /data/detector."""

import argparse
import logging
from pathlib import Path

from training.detector.dataset import generate
from training.detector.settings import SIZES, Settings


def main() -> None:
    """Parse the command line and run the steps."""
    parser = argparse.ArgumentParser(
        prog="python -m training.detector",
        description=__doc__,
        epilog="example: nice python -m training.detector all --out /data/detector",
    )
    parser.add_argument("step", choices=[*STEPS, "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for data and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    for step in STEPS if arguments.step == "all" else [arguments.step]:
        STEPS[step](arguments.out, SIZES[arguments.size])


def _data(out: Path, settings: Settings) -> None:
    for split, shards in settings.shards:
        generate(out / "data", split, range(shards), settings.seed)


def _train(out: Path, settings: Settings) -> None:
    # Torch is imported by the steps that need it: data are drawn without it.
    from training.detector.training import train

    train(out, settings)


STEPS = {"data": _data, "train": _train}

if __name__ == "__main__":
    main()
