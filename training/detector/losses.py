"""Measure how far the network's maps are from the targets."""

import torch
from torch import Tensor
from torch.nn import functional

from training.detector.network import BOX_LOG_RANGE
from training.detector.targets import STRIDE_PX

BOX_WEIGHT = 5.0


def heat_loss(logits: Tensor, heat: Tensor, ignored: Tensor) -> Tensor:
    """Return the focal loss of the heat, per centre; cells near centres count less as misses."""
    probability = logits.sigmoid()
    centre = (heat >= 1.0).float()
    hit = -functional.logsigmoid(logits) * (1 - probability) ** 2 * centre
    away = (1 - heat) ** 4 * (1 - centre) * (1 - ignored)
    miss = -functional.logsigmoid(-logits) * probability**2 * away
    return (hit.sum() + miss.sum()) / centre.sum().clamp(min=1.0)


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
