"""Things on the coffee table of the flat, and butler before it."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vla_deploy.analysis.geometric import GeometricAnalyser
from vla_deploy.analysis.question import question_of
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.robots import load_robot
from vla_deploy.world import Viewpoint

NOW_NS = 1_000_000_000_000
TABLE_M = 0.45
SIZES_M = {
    "cup": (0.07, 0.07, 0.10),
    "bottle": (0.07, 0.07, 0.20),
    "ball": (0.06, 0.06, 0.06),
    "box": (0.24, 0.18, 0.10),
    "book": (0.20, 0.14, 0.03),
    "object": (0.05, 0.05, 0.05),
}
TABLE = {
    "name": "coffee_table",
    "height_m": TABLE_M,
    "polygon_m": [[1.7, 1.28], [2.7, 1.28], [2.7, 1.72], [1.7, 1.72]],
}
BEFORE_TABLE = Viewpoint(x_m=2.2, y_m=2.05, yaw_rad=-math.pi / 2)


@pytest.fixture(scope="session")
def abilities() -> Abilities:
    return Abilities.of(load_robot("butler"))


@pytest.fixture(scope="session")
def geometric(abilities: Abilities) -> GeometricAnalyser:
    return GeometricAnalyser(abilities)


@pytest.fixture(scope="session")
def thing() -> Callable[..., dict[str, Any]]:
    """Return a thing of the scene document, standing on the coffee table unless told otherwise."""

    def thing(name: str, colour: str, x_m: float, y_m: float, **changes: Any) -> dict[str, Any]:
        kind = name.partition("_")[0]
        size_m = changes.pop("size_m", SIZES_M[kind])
        bottom_m = changes.pop("bottom_m", TABLE_M)
        return {
            "id": name,
            "class": kind,
            "colour": colour,
            "position_m": [x_m, y_m, bottom_m + size_m[2] / 2],
            "size_m": list(size_m),
            "yaw_rad": 0.0,
            "last_seen_ns": NOW_NS,
            "seen_count": 9,
            "confidence": 0.9,
        } | changes

    return thing


@pytest.fixture(scope="session")
def ask() -> Callable[..., SceneQuestion]:
    """Return a question about things of the scene document."""

    def ask(
        *things: dict[str, Any],
        goal: str = "",
        robot: Viewpoint | None = BEFORE_TABLE,
        holding: dict[str, str | None] | None = None,
        image: np.ndarray | None = None,
        bystanders: tuple[dict[str, Any], ...] = (),
    ) -> SceneQuestion:
        scene = {
            "stamp_ns": NOW_NS,
            "objects": list(things),
            "surfaces": [TABLE],
            "bystanders": list(bystanders),
        }
        return question_of(
            scene, now_ns=NOW_NS, robot=robot, holding=holding, image=image, goal=goal
        )

    return ask
