"""Run one step, or all: python -m training.speech all --minutes 180 --out /data/speech."""

import argparse
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from training.speech.sizes import SIZES, TrainingSize


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """Hold what a step is told."""

    out: Path
    size: TrainingSize
    budget_s: float
    start_from: Path | None = None


def main() -> None:
    """Parse the command line and run the steps."""
    # Threads that wait for each other at barriers cost more than they bring on a busy computer.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    parser = argparse.ArgumentParser(
        prog="python -m training.speech",
        description=__doc__,
        epilog="example: nice python -m training.speech all --minutes 180 --out /data/speech",
    )
    parser.add_argument("step", choices=[*STEPS, *OTHERS, "all"])
    parser.add_argument("--out", type=Path, required=True, help="folder for clips and models")
    parser.add_argument("--size", choices=SIZES, default="full")
    parser.add_argument(
        "--minutes", type=float, default=180.0,
        help="of training in all; a longer one goes on from a shorter one (default: 180)",
    )  # fmt: skip
    parser.add_argument("--start-from", type=Path, help="folder of a recogniser to go on from")
    parser.add_argument("--seed", type=int, help="of the clips (default: by the size)")
    given = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    if given.step == "all":
        options = ["--out", str(given.out), "--size", given.size, "--minutes", str(given.minutes)]
        options += [] if given.start_from is None else ["--start-from", str(given.start_from)]
        options += [] if given.seed is None else ["--seed", str(given.seed)]
        for step in STEPS:
            subprocess.run([sys.executable, "-m", "training.speech", step, *options], check=True)
        return
    given.out.mkdir(parents=True, exist_ok=True)
    size = SIZES[given.size]
    job = Job(
        out=given.out,
        size=size if given.seed is None else replace(size, seed=given.seed),
        budget_s=60.0 * given.minutes,
        start_from=given.start_from,
    )
    {**STEPS, **OTHERS}[given.step](job)


# What a step needs beyond numpy is imported by that step alone.
def _data(job: Job) -> None:
    from training.speech.clips.data import generate

    generate(job.out / "clips", job.size.shards, job.size.seed, job.size.clips_per_shard)


def _train(job: Job) -> None:
    from training.speech.training import train

    train(job.out, job.size, job.budget_s, job.start_from)


def _export(job: Job) -> None:
    from training.speech.export import export
    from training.speech.shipping import MODEL
    from training.speech.tokens import TOKENIZER
    from training.speech.training import WEIGHTS

    export(job.out / WEIGHTS, job.out / TOKENIZER, job.size, job.out / MODEL)


def _judge(job: Job) -> None:
    from training.speech.shipping import judge

    judge(job.out, job.size)


def _mean(job: Job) -> None:
    from training.speech.training import take_mean

    if job.start_from is None:
        sys.exit("mean: expected --start-from EARLIER, got none: with what it is the mean")
    take_mean(job.out, job.start_from)


def _ship(job: Job) -> None:
    from training.speech.shipping import ship

    ship(job.out)


STEPS: Final[dict[str, Callable[[Job], None]]] = {
    "data": _data,
    "train": _train,
    "export": _export,
    "judge": _judge,
}
"""What `all` does, in this order."""
OTHERS: Final[dict[str, Callable[[Job], None]]] = {"mean": _mean, "ship": _ship}
"""Each a decision of its own; after `mean`, between training and export, nothing else changes."""

if __name__ == "__main__":
    main()
