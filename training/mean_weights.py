"""Take the mean of two trainings that began from the same weights: often better than either."""

from pathlib import Path

import torch
from torch import Tensor


def mean_of(old: Path, new: Path, new_share: float) -> dict[str, Tensor]:
    """Return the mean of the weights in two files, by that share the new ones.

    Raises:
        FileNotFoundError: one of them is not there.
        ValueError: they are not of one shape.
    """
    before, after = (torch.load(path, weights_only=True) for path in (old, new))
    shapes = [{name: values.shape for name, values in one.items()} for one in (before, after)]
    if shapes[0] != shapes[1]:
        raise ValueError(f"{new.parent} and {old.parent} are not of one shape")
    return {name: torch.lerp(before[name], after[name], new_share) for name in after}
