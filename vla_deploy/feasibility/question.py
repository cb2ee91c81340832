"""Hold what is judged: the world as it is known, and what is wanted of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vla_deploy.world import Snapshot

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorPlanBystander:
    """Place a person or a chair on the floor plan; `width_m` is what is seen of it."""

    kind: str
    x_m: float
    y_m: float
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneQuestion:
    """Hold the world as it is known, an image (rows, columns, RGB) or none, and a goal or none.

    `holding` is the kind of thing that each hand holds.
    """

    world: Snapshot
    bystanders: tuple[FloorPlanBystander, ...] = ()
    holding: Mapping[str, str | None] = field(default_factory=dict)
    image: Image | None = None
    goal: str = ""
