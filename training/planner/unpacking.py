"""Write the shipped model as the folder of a finished training, to go on from."""

import shutil
from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch

import vla_deploy
from training.planner.files import GRAPH, TOKENIZER
from training.planner.training import WEIGHTS

SHIPPED: Final = Path(vla_deploy.__file__).parent / "models" / "command_parser"


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
