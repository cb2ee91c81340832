"""Begin a training where an exported model ended.

An export has each batch norm folded into the convolution before it. Whatever statistics a norm is
given, its scale and shift can be chosen so that both together do what the file does; with those of
real data the training goes on without a jolt.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

Array = NDArray[np.float32]
_CONVOLUTIONS = (nn.Conv1d, nn.Conv2d)
_NORMS = (nn.BatchNorm1d, nn.BatchNorm2d)


def begin_from(model: nn.Module, path: Path, data: Tensor) -> None:
    """Give a network the weights of its own export; `data` are typical inputs, many at once.

    In evaluation it then tells what the file tells. Parts that were not exported keep theirs.

    Raises:
        ValueError: the file has other convolutions than the network.
    """
    model.eval()
    stored, called = _stored(path), _in_call_order(model, data[:1])
    convolutions = [one for one in called if isinstance(one, _CONVOLUTIONS)]
    if [tuple(one.weight.shape) for one in convolutions] != [one[0].shape for one in stored]:
        raise ValueError(
            f"{path}: expected the {len(convolutions)} convolutions of this network, got "
            f"{len(stored)}, or others; begin from a file that this training has exported"
        )
    followers = dict(pairwise(called))
    handles = []
    for module, (weight, bias) in zip(convolutions, stored, strict=True):
        module.weight.data.copy_(torch.from_numpy(weight))
        norm = followers.get(module)
        if isinstance(norm, _NORMS):
            handles.append(norm.register_forward_pre_hook(_fitting(torch.from_numpy(bias))))
        else:
            assert module.bias is not None
            module.bias.data.copy_(torch.from_numpy(bias))
    with torch.no_grad():
        model(data)
    for handle in handles:
        handle.remove()


def _fitting(bias: Tensor) -> Callable[[nn.Module, Any], None]:
    """Return what gives a norm the statistics of all that reaches it, and makes up for them."""

    def fit(norm: nn.Module, inputs: Any) -> None:
        assert isinstance(norm, _NORMS)
        assert norm.running_mean is not None
        assert norm.running_var is not None
        by_channel = inputs[0].transpose(0, 1).flatten(1)
        variance, mean = torch.var_mean(by_channel, dim=1, correction=0)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        norm.weight.data.copy_(torch.sqrt(variance + norm.eps))
        norm.bias.data.copy_(bias.to(mean.device) + mean)

    return fit


def _stored(path: Path) -> list[tuple[Array, Array]]:
    """Return weight and bias of each convolution, in the order of the graph."""
    graph = onnx.load(path).graph
    values = {one.name: onnx.numpy_helper.to_array(one) for one in graph.initializer}
    return [
        (np.array(values[node.input[1]]), np.array(values[node.input[2]]))
        for node in graph.node
        if node.op_type == "Conv"
    ]


def _in_call_order(model: nn.Module, data: Tensor) -> list[nn.Module]:
    """Return the network's convolutions and norms in the order in which they are used."""
    called: list[nn.Module] = []
    handles = [
        one.register_forward_pre_hook(lambda it, _: called.append(it))
        for one in model.modules()
        if isinstance(one, (*_CONVOLUTIONS, *_NORMS))
    ]
    with torch.no_grad():
        model(data)
    for handle in handles:
        handle.remove()
    return called
