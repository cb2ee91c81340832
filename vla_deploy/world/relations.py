"""Relate things: in, on, under, next to; and left, right, before, behind as somebody sees them.

One table of relations, each a function of two things and of who looks. Left and right are across
the line of sight to the middle between the two things, in front and behind along it: so they hold
for whoever stands there, whichever way he faces.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.world.footprint import depth_inside_m, gap_m, polygon_depth_m
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.thing import Rest, Snapshot, Surface, Thing, Viewpoint

NEXT_TO: Final = "next to"
NEXT_TO_GAP_M: Final = 0.15
SAME_LEVEL_M: Final = 0.10
# Things farther apart are in different places rather than beside each other.
TOGETHER_M: Final = 1.0
LEAST_OFFSET_M: Final = 0.03
# A diagonal neighbour is both left and behind; what is within 30 degrees of an axis is one of them.
CONE: Final = math.tan(math.radians(30.0))
UNDER_GAP_M: Final = 0.05
NEAR_M: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """Say that `subject` stands in a relation to `other`, both by name."""

    subject: str
    relation: str
    other: str


Test = Callable[[Thing, Thing, Viewpoint | None], bool]


def is_next_to(one: Thing, other: Thing, _: Viewpoint | None = None) -> bool:
    """Return whether two things stand side by side on one level, neither in nor on the other."""
    if one.held_by or other.held_by or _carries(one, other) or _carries(other, one):
        return False
    return abs(one.bottom_m - other.bottom_m) < SAME_LEVEL_M and gap_m(one, other) < NEXT_TO_GAP_M


def is_near(one: Thing, other: Thing, _: Viewpoint | None = None) -> bool:
    """Return whether two things are within half a metre, whatever they stand on."""
    return math.dist(one.position_m, other.position_m) < NEAR_M


def _in(one: Thing, other: Thing, _: Viewpoint | None) -> bool:
    return one.rests == Rest(IN, other.thing_id)


def _on(one: Thing, other: Thing, _: Viewpoint | None) -> bool:
    return one.rests == Rest(ON, other.thing_id)


def _under(one: Thing, other: Thing, _: Viewpoint | None) -> bool:
    return other.rests == Rest(ON, one.thing_id)


def _carries(one: Thing, other: Thing) -> bool:
    return other.rests is not None and other.rests.of == one.thing_id


def _seen(*, beyond: int = 0, left: int = 0) -> Test:
    """Return the test whether, for who looks, one thing lies in a direction from another."""

    def lies_there(one: Thing, other: Thing, view: Viewpoint | None) -> bool:
        offset = _offset(one, other, view)
        if offset is None:
            return False
        beyond_m, left_m = offset
        main_m, aside_m = beyond * beyond_m + left * left_m, left * beyond_m + beyond * left_m
        return main_m > LEAST_OFFSET_M and main_m >= CONE * abs(aside_m)

    return lies_there


RELATIONS: Final[Mapping[str, Test]] = MappingProxyType(
    {
        IN: _in,
        ON: _on,
        "under": _under,
        NEXT_TO: is_next_to,
        "left of": _seen(left=1),
        "right of": _seen(left=-1),
        "in front of": _seen(beyond=-1),
        "behind": _seen(beyond=1),
    }
)


def relations_of(snapshot: Snapshot, view: Viewpoint | None = None) -> Iterator[Relation]:
    """Yield every relation that holds, of things in the scene's order; `view` is the robot's."""
    view = view or snapshot.robot
    for one in snapshot.things:
        if one.rests is not None:
            yield Relation(subject=one.thing_id, relation=one.rests.relation, other=one.rests.of)
        for surface in snapshot.surfaces:
            if is_under(one, surface):
                yield Relation(subject=one.thing_id, relation="under", other=surface.name)
        for other in snapshot.things:
            for name, holds in RELATIONS.items():
                if one is not other and name not in (IN, ON) and holds(one, other, view):
                    yield Relation(subject=one.thing_id, relation=name, other=other.thing_id)


def is_under(thing: Thing, surface: Surface) -> bool:
    """Return whether a thing is below a surface, such as a ball under a table."""
    below = surface.height_m - thing.top_m > UNDER_GAP_M
    return below and polygon_depth_m(thing.position_m, surface.polygon_m) > 0.0


def _offset(one: Thing, other: Thing, view: Viewpoint | None) -> tuple[float, float] | None:
    """Return how far `one` is beyond, and to the left of, `other` for who looks.

    None means that they are not together.
    """
    if view is None or math.dist(one.position_m, other.position_m) > TOGETHER_M:
        return None
    if depth_inside_m(one.position_m, other) > 0.0 or _carries(one, other) or _carries(other, one):
        return None
    middle_x = 0.5 * (one.position_m[0] + other.position_m[0])
    middle_y = 0.5 * (one.position_m[1] + other.position_m[1])
    bearing_rad = math.atan2(middle_y - view.y_m, middle_x - view.x_m)
    return Pose2D(*other.xy_m, bearing_rad).local(one.position_m)
