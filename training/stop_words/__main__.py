"""Run one step, or all: python -m training.stop_words all --out /data/stop_words."""

import argparse
import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from training.stop_words.corpus import speak
from training.stop_words.settings import SIZES, StopWordSettings


def main() -> None:
    """Parse the command line and run the steps."""
    parser = argparse.ArgumentParser(
        prog="python -m training.stop_words",
        description=__doc__,
        epilog="example: nice python -m training.stop_words all --out /data/stop_words",
    )
    parser.add_argument("step", choices=[*STEPS, "ship", "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for clips and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument("--minutes", type=float, help="how long to learn (default: by the size)")
    parser.add_argument("--start-from", type=Path, help="an exported model to go on from")
    parser.add_argument("--seed", type=int, default=0, help="of clips and learning (default: 0)")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    steps = {**STEPS, "ship": _ship}
    for name in STEPS if arguments.step == "all" else [arguments.step]:
        steps[name](arguments.out, _settings_of(arguments))


def _settings_of(arguments: argparse.Namespace) -> StopWordSettings:
    size = SIZES[arguments.size]
    return replace(
        size,
        cpu_minutes=arguments.minutes or size.cpu_minutes,
        start_from=arguments.start_from,
        seed=arguments.seed,
    )


def _speak(out: Path, settings: StopWordSettings) -> None:
    speak(out / "clips", settings.seed, settings.scale)


# The steps below import torch, which the first does not need.
def _train(out: Path, settings: StopWordSettings) -> None:
    from training.stop_words.training import train

    train(out, settings)


def _export(out: Path, _settings: StopWordSettings) -> None:
    from training.stop_words.export import export

    export(out, out / MODELS)


def _evaluate(out: Path, settings: StopWordSettings) -> None:
    from training.stop_words.evaluation import evaluate

    evaluate(out, out / MODELS, settings)


def _judge(out: Path, settings: StopWordSettings) -> None:
    from training.stop_words.evaluation import judge

    judge(out, out / MODELS, settings)


def _card(out: Path, settings: StopWordSettings) -> None:
    from training.stop_words.card import describe

    describe(out, out / MODELS, settings)


def _ship(out: Path, settings: StopWordSettings) -> None:
    from training.stop_words.shipping import ship

    ship(out, out / MODELS, settings)


MODELS = "models"
STEPS: dict[str, Callable[[Path, StopWordSettings], None]] = {
    "speak": _speak,
    "train": _train,
    "export": _export,
    "evaluate": _evaluate,
    "judge": _judge,
    "card": _card,
}
"""What `all` does, in this order; each goes on where it was broken off."""

if __name__ == "__main__":
    main()
