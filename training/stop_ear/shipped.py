"""Read the weights of the ears that were shipped as one, so that a training can go on from them."""

import re
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from torch import Tensor

EAR: Final = re.compile(r"/?ears\.(\d+)[./]")
PLACES: Final = "encoder.embed_positions.weight"
"""Fixed, and cut short in what is shipped."""
_OF_EIGHT_BITS: Final = "MatMulInteger"
_STEP: Final = "/MatMul_quant"


def shipped_weights(path: Path) -> list[dict[str, Tensor]]:
    """Return each ear's weights by the names that they have in training, all as floats.

    Raises:
        FileNotFoundError: there is no such file.
    """
    graph = onnx.load(path).graph
    values = {one.name: onnx.numpy_helper.to_array(one) for one in graph.initializer}
    weights = {name: torch.from_numpy(rows.copy()) for name, rows in values.items()}
    for node in graph.node:
        if node.op_type == _OF_EIGHT_BITS:
            name = node.name.removesuffix(_STEP) + ".weight"
            weights[name] = _as_floats(values, node.input[1].removesuffix("_quantized"))
    ears: dict[int, dict[str, Tensor]] = {}
    for name, rows in weights.items():
        found = EAR.match(name)
        own = "" if found is None else name[found.end() :].replace("/", ".")
        if found is not None and own != PLACES:
            ears.setdefault(int(found[1]), {})[own] = rows
    return [ears[number] for number in sorted(ears)]


def _as_floats(values: dict[str, NDArray[Any]], stem: str) -> Tensor:
    """Return a matrix of eight bits as training has it, the other way round."""
    steps = values[stem + "_quantized"].astype(np.float32) - values[stem + "_zero_point"]
    return torch.from_numpy(np.ascontiguousarray((steps * values[stem + "_scale"]).T, np.float32))
