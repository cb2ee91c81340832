"""Measure how far the network's maps are from the targets."""

import torch
from torch import Tensor
from torch.nn import functional

THING_WEIGHT, NAME_WEIGHT, BOX_WEIGHT = 2.0, 1.0, 2.0
LEAST_QUALITY = 0.5
"""What to say of a core's cell whose box is wrong; the rest is for how well the box fits."""
Maps = tuple[Tensor, Tensor, Tensor]


def losses(maps: Maps, targets: tuple[Tensor, Tensor, Tensor, Tensor]) -> Maps:
    """Return the losses of things, names and boxes, for each core of average size.

    `maps` are the network's, raw; targets are as `Targets` holds them, one image after another.
    """
    things, names, told = maps
    wanted, ignored, edges, share = targets
    overlap, generalised = _overlaps(told, edges)
    whole = share.sum().clamp(min=1.0)
    in_core = wanted >= 0
    unnamed = functional.cross_entropy(names, wanted.clamp(min=0), reduction="none")
    return (
        THING_WEIGHT * _thing_loss(things[:, 0], in_core, ignored, share, overlap.detach()) / whole,
        NAME_WEIGHT * (unnamed * share).sum() / whole,
        BOX_WEIGHT * ((1 - generalised) * share).sum() / whole,
    )


def _thing_loss(
    logits: Tensor, in_core: Tensor, ignored: Tensor, share: Tensor, overlap: Tensor
) -> Tensor:
    """Return the quality focal loss: the surest cell of a thing should tell the best box."""
    quality = LEAST_QUALITY + (1 - LEAST_QUALITY) * overlap.clamp(0, 1)
    aim = torch.where(in_core, quality, torch.zeros_like(quality))
    entropy = functional.binary_cross_entropy_with_logits(logits, aim, reduction="none")
    weight = torch.where(in_core, share, 1 - ignored)
    return (entropy * (logits.sigmoid() - aim) ** 2 * weight).sum()


def _overlaps(told: Tensor, edges: Tensor) -> tuple[Tensor, Tensor]:
    """Return intersection over union of the boxes of each cell, and the generalised one."""
    low, high = torch.minimum(told, edges), torch.maximum(told, edges)
    inner = (low[:, 0] + low[:, 2]).clamp(min=0) * (low[:, 1] + low[:, 3]).clamp(min=0)
    hull = (high[:, 0] + high[:, 2]) * (high[:, 1] + high[:, 3])
    union = _area(told) + _area(edges) - inner
    overlap = inner / union
    return overlap, overlap - (hull - union) / hull


def _area(edges: Tensor) -> Tensor:
    return (edges[:, 0] + edges[:, 2]) * (edges[:, 1] + edges[:, 3])
