"""Take the mean of a training and the one that it went on from.

Both find their ways through phrases that neither has learnt, and each errs by itself: their mean
errs less than either (Wortsman et al., "Model soups", 2022).
"""

import shutil
from pathlib import Path
from typing import Final

import torch

from training.mean_weights import mean_of
from training.planner.files import MEAN_OF, TOKENIZER
from training.planner.training import WEIGHTS

NEW_SHARE: Final = 0.75


def mean(out: Path, earlier: Path, into: Path) -> None:
    """Write the mean of the weights under `out` and `earlier`, with the tokenizer, under `into`.

    Raises:
        FileNotFoundError: one of them has not been trained.
        ValueError: they are not of one shape, or have not one tokenizer.
    """
    if (out / TOKENIZER).read_bytes() != (earlier / TOKENIZER).read_bytes():
        raise ValueError(f"{out} and {earlier} have not the same {TOKENIZER}: none began from one")
    weights = mean_of(earlier / WEIGHTS, out / WEIGHTS, NEW_SHARE)
    into.mkdir(parents=True, exist_ok=True)
    shutil.copy(out / TOKENIZER, into / TOKENIZER)
    torch.save(weights, into / WEIGHTS)
    told = f"Its weights are the mean of both, by {NEW_SHARE:.0%} the later (step `mean`)."
    (into / MEAN_OF).write_text(told, encoding="utf-8")
