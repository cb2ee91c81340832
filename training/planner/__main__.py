"""Run one step, or all: python -m training.planner all --out /data/planner."""

import argparse
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Final

from training.planner.sentences.chatter import read_chatter
from training.planner.settings import SIZES, PlannerSettings

_EXAMPLE: Final = (
    "example: nice python -m training.planner all --out /data/planner --chatter data_full.json"
)
_JUDGED: Final = 400
MODELS: Final = "models"
_UNSEEN: Final = ("val", "oos_val", "oos_test", "test")
Step = Callable[[argparse.Namespace, PlannerSettings], None]


def main() -> None:
    """Parse the command line and run the steps."""
    parser = argparse.ArgumentParser(
        prog="python -m training.planner", description=__doc__, epilog=_EXAMPLE
    )
    parser.add_argument("step", choices=[*STEPS, *OTHERS, "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for states and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument("--threads", type=int, default=1, help="of the training (default: 1)")
    parser.add_argument(
        "--chatter", type=Path, metavar="FILE", help="data_full.json of CLINC150: other talk"
    )
    parser.add_argument(
        "--start-from", type=Path, metavar="OUT", help="folder of a training to go on from"
    )
    parser.add_argument(
        "--mean-into", type=Path, metavar="NEW", help="of `mean`: the folder for the mean of both"
    )
    arguments = parser.parse_args()
    if arguments.step == "mean" and None in (arguments.start_from, arguments.mean_into):
        parser.error("mean: expected --start-from EARLIER and --mean-into NEW")
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    for name in STEPS if arguments.step == "all" else [arguments.step]:
        {**STEPS, **OTHERS}[name](arguments, SIZES[arguments.size])


def _talk(arguments: argparse.Namespace) -> tuple[str, ...]:
    return read_chatter(arguments.chatter) if arguments.chatter else ()


# The steps below import torch and onnx only where they need them.
def _train(arguments: argparse.Namespace, settings: PlannerSettings) -> None:
    import torch

    from training.planner.training import train

    torch.set_num_threads(arguments.threads)
    train(arguments.out, settings, _talk(arguments), arguments.start_from)


def _export(arguments: argparse.Namespace, settings: PlannerSettings) -> None:
    from training.planner.export import export

    export(arguments.out, arguments.out / MODELS, settings.shape, _talk(arguments))


def _evaluate(arguments: argparse.Namespace, _settings: PlannerSettings) -> None:
    from random import Random

    from training.planner.evaluation import evaluate

    unseen = list(read_chatter(arguments.chatter, _UNSEEN)) if arguments.chatter else []
    Random(1).shuffle(unseen)
    evaluate(arguments.out / MODELS, _JUDGED, unseen)


def _card(arguments: argparse.Namespace, settings: PlannerSettings) -> None:
    from training.planner.card import describe

    describe(arguments.out / MODELS, settings, arguments.chatter is not None, arguments.start_from)


def _ship(arguments: argparse.Namespace, _settings: PlannerSettings) -> None:
    from training.planner.shipping import ship

    ship(arguments.out / MODELS)


def _mean(arguments: argparse.Namespace, _settings: PlannerSettings) -> None:
    from training.planner.going_on import mean

    mean(arguments.out, arguments.start_from, arguments.mean_into)


def _unpack(arguments: argparse.Namespace, _settings: PlannerSettings) -> None:
    from training.planner.going_on import unpack

    unpack(arguments.out)


STEPS: dict[str, Step] = {
    "train": _train,
    "export": _export,
    "evaluate": _evaluate,
    "card": _card,
}
"""What `all` does, in this order; shipping is a decision of its own."""
OTHERS: dict[str, Step] = {"mean": _mean, "ship": _ship, "unpack": _unpack}

if __name__ == "__main__":
    main()
