"""Run one step, or all: python -m training.detector all --out /data/detector."""

import argparse
import logging
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from training.detector.card import describe
from training.detector.dataset import generate
from training.detector.files import FILES
from training.detector.settings import SIZES, DetectorSettings
from training.detector.shipping import ship


def main() -> None:
    """Parse the command line and run the steps."""
    parser = argparse.ArgumentParser(
        prog="python -m training.detector",
        description=__doc__,
        epilog="example: nice python -m training.detector all --out /data/detector",
    )
    parser.add_argument("step", choices=[*STEPS, "ship", "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for data and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument("--threads", type=int, default=1, help="of the training (default: 1)")
    parser.add_argument("--start-from", type=Path, help="an exported fp32 model to go on from")
    parser.add_argument("--seed", type=int, default=0, help="of training images (default: 0)")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    if arguments.step == "all":
        _run_all(_options(arguments))
        return
    settings = replace(
        SIZES[arguments.size],
        threads=arguments.threads,
        start_from=arguments.start_from,
        seed=arguments.seed,
    )
    {**STEPS, "ship": _ship}[arguments.step](arguments.out, settings)


def _options(arguments: argparse.Namespace) -> list[str]:
    given = vars(arguments) | {"step": None}
    return [
        word
        for name, value in given.items()
        if value is not None
        for word in (f"--{name.replace('_', '-')}", str(value))
    ]


def _run_all(options: list[str]) -> None:
    """Run each step in a process of its own: Mesa's LLVM and torch crash each other in one."""
    for step in STEPS:
        subprocess.run([sys.executable, "-m", "training.detector", step, *options], check=True)


def _data(out: Path, settings: DetectorSettings) -> None:
    for split, shards in settings.shards:
        seed = settings.seed if split == "train" else JUDGED_SEED
        generate(out / "data", split, range(shards), seed)


# The steps below import torch and onnx, which the first does not need.
def _train(out: Path, settings: DetectorSettings) -> None:
    from training.detector.training import train

    train(out, settings)


def _export(out: Path, settings: DetectorSettings) -> None:
    from training.detector.export import export, quantise

    export(out, out / MODELS)
    quantise(out, out / MODELS, settings)


def _evaluate(out: Path, settings: DetectorSettings) -> None:
    from training.detector.evaluation import evaluate

    evaluate(out / MODELS, out / "data", FILES, settings)


def _card(out: Path, settings: DetectorSettings) -> None:
    describe(out / MODELS, settings)


def _ship(out: Path, _settings: DetectorSettings) -> None:
    ship(out / MODELS)


MODELS = "models"
JUDGED_SEED = 0
"""All models are judged on the same images."""
STEPS: dict[str, Callable[[Path, DetectorSettings], None]] = {
    "data": _data,
    "train": _train,
    "export": _export,
    "evaluate": _evaluate,
    "card": _card,
}
"""What `all` does, in this order; shipping is a decision of its own."""

if __name__ == "__main__":
    main()
