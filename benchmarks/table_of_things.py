"""Draw random arrangements of the flat's things on its coffee table, and tell what is true of them.

Sizes are those of `sim_twin/worlds/flat.xml`; places are the referee's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.resting import rest_of
from vla_deploy.world.thing import Surface

TABLE: Final = Surface(
    name="coffee_table",
    height_m=0.45,
    polygon_m=((1.7, 1.28), (2.7, 1.28), (2.7, 1.72), (1.7, 1.72)),
)
X_M, Y_M = (1.85, 2.55), (1.42, 1.64)
APART_M: Final = 0.13
BOX_APART_M: Final = 0.22
BOX_FLOOR_M: Final = 0.008
TRIES: Final = 1000

Pose = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ThingShape:
    """Give a thing's size, and how high its body's origin and centre of mass lie in it."""

    kind: str
    colour: str
    size_m: tuple[float, float, float]
    origin_m: float
    mass_at_m: float


SHAPES: Final[Mapping[str, ThingShape]] = MappingProxyType(
    {
        "box": ThingShape(
            kind="box",
            colour="orange",
            size_m=(0.232, 0.232, 0.128),
            origin_m=0.0,
            mass_at_m=0.0424,
        ),
        "red_cup": ThingShape(
            kind="cup",
            colour="red",
            size_m=(0.066, 0.066, 0.095),
            origin_m=0.0475,
            mass_at_m=0.0475,
        ),
        "blue_ball": ThingShape(
            kind="ball", colour="blue", size_m=(0.05, 0.05, 0.05), origin_m=0.025, mass_at_m=0.025
        ),
        "book": ThingShape(
            kind="book", colour="purple", size_m=(0.15, 0.065, 0.04), origin_m=0.02, mass_at_m=0.02
        ),
        "bottle": ThingShape(
            kind="bottle",
            colour="green",
            size_m=(0.06, 0.06, 0.18),
            origin_m=0.09,
            mass_at_m=0.0725,
        ),
    }
)


def draw_arrangement(random: np.random.Generator) -> dict[str, Pose]:
    """Return x, y, height of what it stands on, and yaw of each thing; some are in the box.

    The cup is in the box every other time; the rest stands on the table, often close together.
    """
    placed: dict[str, Pose] = {}
    for name in SHAPES:
        if name == "red_cup" and random.random() < 0.5:
            x_m, y_m, _, _ = placed["box"]
            dx, dy = random.uniform(-0.04, 0.04, 2)
            on_m = TABLE.height_m + BOX_FLOOR_M
            placed[name] = (x_m + float(dx), y_m + float(dy), on_m, 0.0)
            continue
        placed[name] = _free_spot(name, placed, random)
    return placed


def _free_spot(name: str, placed: Mapping[str, Pose], random: np.random.Generator) -> Pose:
    for _ in range(TRIES):
        x_m, y_m = float(random.uniform(*X_M)), float(random.uniform(*Y_M))
        apart = {other: math.dist((x_m, y_m), pose[:2]) for other, pose in placed.items()}
        if all(gap_m > (BOX_APART_M if other == "box" else APART_M)
               for other, gap_m in apart.items()):  # fmt: skip
            return x_m, y_m, TABLE.height_m, float(random.uniform(-0.6, 0.6))
    raise RuntimeError(f"no free spot for the {name} after {TRIES} tries")


def true_snapshot(truth: Mapping[str, Any]) -> Snapshot:
    """Return the things as they really are, with the rules of the world model applied to them."""
    things = [_thing(name, truth["objects"][name]) for name in SHAPES]
    rested = tuple(replace(one, rests=rest_of(one, things, [TABLE])) for one in things)
    robot = truth["robot"]
    view = Viewpoint(x_m=robot["x_m"], y_m=robot["y_m"], yaw_rad=robot["yaw_rad"])
    return Snapshot(stamp_ns=0, things=rested, robot=view)


def _thing(name: str, body: Mapping[str, Any]) -> Thing:
    shape = SHAPES[name]
    x_m, y_m, z_m = body["position_m"]
    w, _, _, z = body["quaternion_wxyz"]
    return Thing(
        thing_id=name,
        kind=shape.kind,
        colour=shape.colour,
        position_m=(x_m, y_m, z_m - shape.mass_at_m + 0.5 * shape.size_m[2]),
        size_m=shape.size_m,
        yaw_rad=2.0 * math.atan2(z, w),
    )
