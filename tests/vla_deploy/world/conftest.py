"""Small worlds: things where a test says."""

from collections.abc import Callable
from typing import Any

import pytest

from vla_deploy.world import Snapshot, Thing, Viewpoint

SIZES = {
    "cup": (0.066, 0.066, 0.095),
    "ball": (0.05, 0.05, 0.05),
    "book": (0.2, 0.13, 0.04),
    "box": (0.24, 0.24, 0.13),
    "bottle": (0.06, 0.06, 0.18),
}
TABLE_M = 0.45


def make_thing(name: str, x_m: float, y_m: float, on_m: float = TABLE_M, **changes: Any) -> Thing:
    """Stand a thing on something `on_m` high; "cup_2" is a cup."""
    kind = name.partition("_")[0]
    size_m = changes.pop("size_m", SIZES.get(kind, (0.06, 0.06, 0.06)))
    fields: dict[str, Any] = {
        "thing_id": name if "_" in name else f"{name}_1",
        "kind": kind,
        "colour": "red",
        "position_m": (x_m, y_m, on_m + 0.5 * size_m[2]),
        "size_m": size_m,
    }
    return Thing(**(fields | changes))


def make_world(*things: Thing, **changes: Any) -> Snapshot:
    """Let the robot stand at the origin and look along x."""
    fields = {"stamp_ns": 1_000_000_000, "robot": Viewpoint(x_m=0.0, y_m=0.0), "things": things}
    return Snapshot(**(fields | changes))


@pytest.fixture
def thing() -> Callable[..., Thing]:
    """Stand one thing somewhere."""
    return make_thing


@pytest.fixture
def world() -> Callable[..., Snapshot]:
    """Let the robot look at some things."""
    return make_world
