"""Prepare what a training may go on from: the shipped model, or the mean of two trainings.

Both trainings find their ways through phrases that neither has learnt, and each errs by itself:
their mean errs less than either (Wortsman et al., "Model soups", 2022).
"""

import shutil
from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch

import vla_deploy
from training.mean_weights import mean_of
from training.planner.files import GRAPH, MEAN_OF, TOKENIZER
from training.planner.network import deepened, layers_of
from training.planner.training import WEIGHTS

SHIPPED: Final = Path(vla_deploy.__file__).parent / "models" / "command_parser"
NEW_SHARE: Final = 0.75


def mean(out: Path, earlier: Path, into: Path) -> None:
    """Write the mean of the weights under `out` and `earlier`, with the tokenizer, under `into`.

    An earlier one of fewer layers is deepened first, as it was when the later training began.

    Raises:
        FileNotFoundError: one of them has not been trained.
        ValueError: they are not of one shape, or have not one tokenizer.
    """
    if (out / TOKENIZER).read_bytes() != (earlier / TOKENIZER).read_bytes():
        raise ValueError(f"{out} and {earlier} have not the same {TOKENIZER}: none began from one")
    before, after = (torch.load(one / WEIGHTS, weights_only=True) for one in (earlier, out))
    if layers_of(before) < layers_of(after):
        before = deepened(before, after)
    weights = mean_of(before, after, NEW_SHARE)
    into.mkdir(parents=True, exist_ok=True)
    shutil.copy(out / TOKENIZER, into / TOKENIZER)
    torch.save(weights, into / WEIGHTS)
    told = f"Its weights are the mean of both, by {NEW_SHARE:.0%} the later (step `mean`)."
    (into / MEAN_OF).write_text(told, encoding="utf-8")


def unpack(out: Path) -> None:
    """Write weights and tokenizer into `out`, for `--start-from`."""
    out.mkdir(parents=True, exist_ok=True)
    stored = {
        one.name: np.array(onnx.numpy_helper.to_array(one))
        for one in onnx.load(SHIPPED / GRAPH).graph.initializer
    }
    state = {"embedding.weight": stored["embedding"], "norm.weight": stored["norm.weight"]}
    for name, values in stored.items():
        if name[0].isdigit():
            # The graph multiplies from the other side.
            state[f"layers.{name}"] = values.T if values.ndim == 2 else values
    tensors = {name: torch.from_numpy(np.ascontiguousarray(one)) for name, one in state.items()}
    torch.save(tensors, out / WEIGHTS)
    shutil.copyfile(SHIPPED / TOKENIZER, out / TOKENIZER)
