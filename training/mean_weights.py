"""Take the mean of two trainings that began from the same weights: often better than either."""

from collections.abc import Mapping

import torch
from torch import Tensor


def mean_of(
    before: Mapping[str, Tensor], after: Mapping[str, Tensor], new_share: float
) -> dict[str, Tensor]:
    """Return the mean of two networks' weights, by that share the later ones.

    Raises:
        ValueError: they are not of one shape.
    """
    shapes = [{name: values.shape for name, values in one.items()} for one in (before, after)]
    if shapes[0] != shapes[1]:
        raise ValueError("they are not of one shape")
    return {name: torch.lerp(before[name], after[name], new_share) for name in after}
