"""Hold what is true of the flat in which plans are judged: furniture, places, things, keep-out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.robots import load_robot

Point = tuple[float, float]
Pose = tuple[float, float, float]

ROBOT: Final = "butler"
FLOOR: Final = "floor"
WITH_SPEAKER: Final = ("with", "speaker")
"""What a thing rests in that somebody has taken from the robot."""
WIDTH_M, DEPTH_M = 8.0, 6.0
HANDS: Final = ("left", "right")
CONTAINERS: Final = frozenset({"box"})
GRASPABLE: Final = frozenset(
    {"cup", "ball", "book", "bottle", "phone", "keys", "bowl", "can", "remote"}
)
# What other things can be put on; round and small tops carry nothing.
SUPPORTS: Final = frozenset({"book"})
SIZES_M: Final[Mapping[str, tuple[float, float, float]]] = MappingProxyType({
    "cup": (0.066, 0.066, 0.095), "ball": (0.05, 0.05, 0.05), "book": (0.15, 0.065, 0.04),
    "bottle": (0.06, 0.06, 0.18), "phone": (0.13, 0.065, 0.012), "keys": (0.07, 0.04, 0.016),
    "box": (0.232, 0.232, 0.128), "bowl": (0.07, 0.07, 0.05), "can": (0.066, 0.066, 0.115),
    "remote": (0.16, 0.045, 0.02),
})  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Furniture:
    """Hold a level top: its middle, half its sides, and its height, in metres."""

    middle_m: Point
    half_m: Point
    height_m: float

    def corners_m(self) -> list[Point]:
        """Return its outline, counter-clockwise."""
        (x_m, y_m), (dx_m, dy_m) = self.middle_m, self.half_m
        ways = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        return [(x_m + sx * dx_m, y_m + sy * dy_m) for sx, sy in ways]

    def away_m(self, point: Point) -> float:
        """Return how far a point of the floor plan is from its outline."""
        gaps = (
            max(0.0, abs(there - middle) - half)
            for there, middle, half in zip(point, self.middle_m, self.half_m, strict=True)
        )
        return math.hypot(*gaps)


# As in sim_twin/worlds/flat.xml.
FURNITURE: Final[Mapping[str, Furniture]] = MappingProxyType({
    "coffee_table": Furniture(middle_m=(2.2, 1.5), half_m=(0.5, 0.22), height_m=0.45),
    "side_table": Furniture(middle_m=(4.2, 0.45), half_m=(0.2, 0.2), height_m=0.42),
    "kitchen_table": Furniture(middle_m=(6.3, 4.4), half_m=(0.65, 0.24), height_m=0.5),
    "bedside_table": Furniture(middle_m=(0.26, 3.85), half_m=(0.22, 0.2), height_m=0.5),
})  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class FlatThing:
    """Hold one thing as it is; `rests` is a relation and what it rests in or on.

    `is_seen` tells whether the robot knows of it; `aliases` are other ids of it.
    """

    thing_id: str
    kind: str
    colour: str
    xy_m: Point
    size_m: tuple[float, float, float]
    rests: tuple[str, str]
    held_by: str = ""
    is_seen: bool = True
    aliases: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FlatHome:
    """Hold what the robot file says of the flat: places, their spoken names, poses, keep-out."""

    places: Mapping[str, Pose]
    spoken: Mapping[str, str]
    arm_poses: frozenset[str]
    keep_out: tuple[tuple[Point, ...], ...]

    def is_kept_out(self, point: Point) -> bool:
        """Return whether a point of the floor lies where the robot must not go, or outside."""
        x_m, y_m = point
        inside = 0.0 <= x_m <= WIDTH_M and 0.0 <= y_m <= DEPTH_M
        return not inside or any(_contains(polygon, point) for polygon in self.keep_out)


def load_home() -> FlatHome:
    """Return the flat of the robot file."""
    robot = load_robot(ROBOT)
    places = {
        name: (place.pose.x_m, place.pose.y_m, place.pose.yaw_rad)
        for name, place in robot.home.places.items()
    }
    spoken = {
        words.replace("_", " ").removeprefix("the ").lower(): name
        for name, place in robot.home.places.items()
        for words in (name, *place.aliases)
    }
    return FlatHome(
        places=places,
        spoken=spoken,
        arm_poses=frozenset(robot.poses),
        keep_out=tuple(zone.polygon_m for zone in robot.home.zones),
    )


def thing_of(told: Mapping[str, Any]) -> FlatThing:
    """Return one thing of the scenes' file; where it is held or in another, the place follows."""
    relation = "in" if "in" in told else "on" if "on" in told else ""
    rests = (relation, str(told[relation])) if relation else ("", "")
    kind = str(told["class"])
    default_m = SIZES_M.get(kind, (0.06, 0.06, 0.06))
    x_m, y_m = told.get("at", (0.0, 0.0))
    return FlatThing(
        thing_id=str(told["id"]),
        kind=kind,
        colour=str(told["colour"]),
        xy_m=(float(x_m), float(y_m)),
        size_m=tuple(told.get("size_m", default_m)),
        rests=rests,
        held_by=str(told.get("held", "")),
        is_seen=bool(told.get("seen", True)),
        aliases=tuple(told.get("aliases", ())),
    )


def _contains(polygon: tuple[Point, ...], point: Point) -> bool:
    """Return whether a convex polygon, counter-clockwise, contains a point."""
    x_m, y_m = point
    edges = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return all(
        (bx - ax) * (y_m - ay) - (by - ay) * (x_m - ax) >= 0.0 for (ax, ay), (bx, by) in edges
    )
