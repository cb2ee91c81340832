"""Pick what is said by chance."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def pick(values: Sequence[T], random: np.random.Generator) -> T:
    """Return one of the values, each as likely."""
    return values[int(random.integers(len(values)))]
