"""Measure how far the network's maps are from the targets."""

import torch
from torch import Tensor
from torch.nn import functional

from training.detector.network import BOX_LOG_RANGE
from training.detector.targets import STRIDE_PX

HEAT_WEIGHT, BOX_WEIGHT = 10.0, 5.0
SEEN_HEAT = 0.1


def heat_loss(logits: Tensor, heat: Tensor, ignored: Tensor) -> Tensor:
    """Return the quality focal loss of the heat, per thing.

    Each cell has a value to reach, however near to a centre it is: a loss with one right cell per
    thing would ask for a centre more exactly than an image of this size shows it.
    """
    entropy = functional.binary_cross_entropy_with_logits(logits, heat, reduction="none")
    counts = 1 - ignored * (heat < SEEN_HEAT)
    loss = entropy * (logits.sigmoid() - heat) ** 2 * counts
    return HEAT_WEIGHT * loss.sum() / heat.sum().clamp(min=1.0)


def box_loss(logs: Tensor, edges: Tensor, share: Tensor) -> Tensor:
    """Return the generalised IoU loss, weighted by each cell's share."""
    told = STRIDE_PX * torch.exp(logs.clamp(*BOX_LOG_RANGE))
    smaller, larger = torch.minimum(told, edges), torch.maximum(told, edges)
    inner = (smaller[:, 0] + smaller[:, 2]) * (smaller[:, 1] + smaller[:, 3])
    hull = (larger[:, 0] + larger[:, 2]) * (larger[:, 1] + larger[:, 3])
    union = _area(told) + _area(edges) - inner
    generalised = inner / union - (hull - union) / hull
    return BOX_WEIGHT * ((1 - generalised) * share).sum() / share.sum().clamp(min=1e-3)


def _area(edges: Tensor) -> Tensor:
    return (edges[:, 0] + edges[:, 2]) * (edges[:, 1] + edges[:, 3])
