"""Take numbers from the command line, within bounds."""

import argparse
import math
from collections.abc import Callable


def number_within(low: float, high: float, expected: str) -> Callable[[str], float]:
    """Return what argparse takes for a `type`: finite numbers from `low` to `high`, both included.

    `expected` tells them to whoever gave another one.
    """

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}")
        return value

    return parse
