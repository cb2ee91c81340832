"""Sum up what was measured by its percentiles, also where nothing was."""

from collections.abc import Sequence

import numpy as np


def percentile(values: Sequence[float], percent: float) -> float | None:
    """Return a percentile, or None of nothing."""
    return float(np.percentile(values, percent)) if values else None


def spread_s(name: str, values_s: Sequence[float]) -> dict[str, float | None]:
    """Return median and tail of some seconds, as `NAME_p50_s` and `NAME_p95_s`."""
    return {f"{name}_p{percent}_s": percentile(values_s, percent) for percent in (50, 95)}
