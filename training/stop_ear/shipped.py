"""Read the weights of an ear that was shipped, so that a training can go on from it."""

from pathlib import Path
from typing import Final

import numpy as np
import onnx
import torch
from torch import Tensor

EAR: Final = "ear."
PLACES: Final = "encoder.embed_positions.weight"
"""Fixed, and cut short in what is shipped."""
_OF_EIGHT_BITS: Final = "MatMulInteger"
_STEP: Final = "/MatMul_quant"


def shipped_weights(path: Path) -> dict[str, Tensor]:
    """Return the weights by the names that they have in training, those of eight bits as floats.

    Raises:
        FileNotFoundError: there is no such file.
    """
    graph = onnx.load(path).graph
    values = {one.name: onnx.numpy_helper.to_array(one) for one in graph.initializer}
    weights = {
        name.removeprefix(EAR): torch.from_numpy(rows.copy())
        for name, rows in values.items()
        if name.startswith(EAR) and name != EAR + PLACES
    }
    for node in graph.node:
        if node.op_type == _OF_EIGHT_BITS:
            name = node.name.removeprefix("/ear/").removesuffix(_STEP).replace("/", ".")
            stem = node.input[1].removesuffix("_quantized")
            steps = values[node.input[1]].astype(np.float32) - values[stem + "_zero_point"]
            rows = steps * values[stem + "_scale"]
            weights[name + ".weight"] = torch.from_numpy(np.ascontiguousarray(rows.T, np.float32))
    return weights
