"""Step along orthogonalised gradients.

Muon, K. Jordan et al. 2024: the momentum of a weight matrix is replaced by the nearest matrix whose
singular values are all about one, so that rare directions are learnt as fast as common ones.
"""

from collections.abc import Iterable

import torch
from torch import Tensor, nn

QUINTIC = (3.4445, -4.7750, 2.0315)
"""Coefficients of the published Newton-Schulz iteration; singular values end from 0.7 to 1.2."""
ITERATIONS = 5
MOMENTUM = 0.95
WEIGHT_DECAY = 0.05
_LEAST_NORM = 1e-7


class Muon(torch.optim.Optimizer):
    """Optimise weights of two and more dimensions; the first one counts outputs."""

    def __init__(
        self,
        weights: Iterable[nn.Parameter],
        learning_rate: float,
        weight_decay: float = WEIGHT_DECAY,
    ) -> None:
        super().__init__(weights, {"lr": learning_rate, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Move every weight that has a gradient."""
        for group in self.param_groups:
            for weight in group["params"]:
                if weight.grad is not None:
                    self._move(weight, group["lr"], group["weight_decay"])

    def _move(self, weight: Tensor, rate: float, decay: float) -> None:
        state = self.state[weight]
        momentum = state.setdefault("momentum", torch.zeros_like(weight))
        momentum.lerp_(weight.grad, 1 - MOMENTUM)
        way = orthogonalised(weight.grad.lerp(momentum, MOMENTUM))  # type: ignore[union-attr]
        # Tall matrices have fewer singular values than outputs: each output would move less.
        outputs, inputs = weight.shape[0], weight[0].numel()
        weight.mul_(1 - rate * decay).add_(way, alpha=-rate * max(1.0, outputs / inputs) ** 0.5)


def orthogonalised(values: Tensor) -> Tensor:
    """Return that matrix with singular values near one; all dimensions but the first count as one.

    Computed in bfloat16, whose errors the iteration evens out.
    """
    linear, cubic, quintic = QUINTIC
    matrix = values.flatten(1).bfloat16()
    is_tall = matrix.shape[0] > matrix.shape[1]
    matrix = matrix.T if is_tall else matrix
    matrix = matrix / (matrix.norm() + _LEAST_NORM)
    for _ in range(ITERATIONS):
        square = matrix @ matrix.T
        matrix = linear * matrix + (cubic * square + quintic * square @ square) @ matrix
    return (matrix.T if is_tall else matrix).to(values.dtype).reshape(values.shape)
