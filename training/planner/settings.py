"""Set the sizes of the network and of a training."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkShape:
    """Hold the sizes of the network."""

    vocabulary: int = 2048
    width: int = 192
    layers: int = 4
    heads: int = 4
    inner: int = 512
    rope_theta: float = 10_000.0
    epsilon: float = 1e-5

    @property
    def head_width(self) -> int:
        """Return the width of one head."""
        return self.width // self.heads


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerSettings:
    """Hold how long to train on how much; `budget_s` is wall-clock time, over all sittings.

    `rate` is the largest step of AdamW, which the embedding and the norms take; `matrix_rate` that
    of Muon, which the matrices take. `pool` examples are drawn and sorted by length at a time.
    """

    name: str
    budget_s: float
    shape: NetworkShape = field(default_factory=NetworkShape)
    seed: int = 6
    batch: int = 64
    pool: int = 8192
    rate: float = 2e-3
    matrix_rate: float = 0.015
    decay: float = 0.02
    warm_up_ratio: float = 0.02
    judged: int = 400
    save_every_s: float = 120.0


SIZES: Final[Mapping[str, PlannerSettings]] = {
    "tiny": PlannerSettings(
        name="tiny",
        budget_s=4.0,
        shape=NetworkShape(width=32, layers=2, heads=2, inner=64),
        batch=32,
        pool=256,
        judged=20,
    ),
    "trial": PlannerSettings(name="trial", budget_s=180.0),
    "full": PlannerSettings(name="full", budget_s=3600.0),
    # Of the same shape: it can go on from where the other one ended.
    "long": PlannerSettings(name="long", budget_s=14_400.0),
    # For going on from a training that is finished: smaller steps.
    "more": PlannerSettings(name="more", budget_s=4500.0, rate=1.2e-3, matrix_rate=0.009, seed=7),
    # Twice as many layers, on the weights of a finished training of one of the sizes above.
    "deep": PlannerSettings(
        name="deep",
        budget_s=6300.0,
        shape=NetworkShape(layers=8),
        rate=1.5e-3,
        matrix_rate=0.012,
        seed=8,
    ),
}
