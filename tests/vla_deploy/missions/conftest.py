"""What missions are judged against: the butler's flat, two things, a robot in the kitchen."""

from collections.abc import Callable
from typing import Any

import pytest

from vla_deploy.missions.criteria import Facts
from vla_deploy.plans.knowledge import World, world_of
from vla_deploy.robots import load_robot
from vla_deploy.world import read_snapshot

NS = 1_000_000_000


@pytest.fixture(scope="session")
def butler() -> Any:
    return load_robot("butler")


@pytest.fixture(scope="session")
def world(butler: Any) -> World:
    return world_of(butler, {"left": None, "right": None})


@pytest.fixture
def facts(butler: Any) -> Callable[..., Facts]:
    """Make facts: the red cup rests `cup`, the left hand holds `left`."""

    def make(cup: tuple[str, str] | None = None, left: str | None = None, place: str = "kitchen"):
        things = [
            {"id": name, "class": name.partition("_")[0], "colour": colour,
             "position_m": [2.0, 1.5, 0.5], "size_m": [0.07, 0.07, 0.1], "last_seen_ns": NS,
             **({"rests": {"relation": rests[0], "of": rests[1]}} if rests else {}),
             **({"held_by": "left"} if held else {})}
            for name, colour, rests, held in (
                ("cup_1", "red", cup, left == "cup"), ("box_1", "brown", ("on", "floor"), False))
        ]  # fmt: skip
        pose = butler.places[place].pose
        return Facts(
            world=world_of(butler, {"left": left, "right": None}),
            scene=read_snapshot({"stamp_ns": NS, "objects": things}, NS),
            here=(pose.x_m, pose.y_m, pose.yaw_rad),
        )

    return make
