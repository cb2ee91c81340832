"""Tell what a thing rests in or on, without flicker: what holds is given up later than it began.

Every bound has two values. The narrow one begins a relation, the wide one keeps it, so that the
noise of a sight (some millimetres) cannot switch a thing between two supports.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.world.footprint import depth_inside_m, polygon_depth_m
from vla_deploy.world.thing import FLOOR, Rest, Surface, Thing
from vla_deploy.world.vocabulary import ANY_CLASS, CONTAINERS

IN: Final = "in"
ON: Final = "on"


@dataclass(frozen=True, slots=True, kw_only=True)
class RelationBounds:
    """Bound one relation.

    `inside_m` is how far the thing's middle must lie within the outline, `sunk_m` how far its
    underside must lie below a container's rim, `gap_m` how far it may be from what carries it.
    """

    inside_m: float
    sunk_m: float
    gap_m: float


BEGIN: Final = RelationBounds(inside_m=0.0, sunk_m=0.015, gap_m=0.025)
KEEP: Final = RelationBounds(inside_m=-0.03, sunk_m=-0.005, gap_m=0.045)
# Where a hand has just let go, only the hand's place is known.
LET_GO: Final = RelationBounds(inside_m=0.0, sunk_m=0.0, gap_m=0.07)
# The bottom of a container is not below its outside, within what a sight is wrong.
BELOW_CONTAINER_M: Final = 0.03


def rest_of(
    thing: Thing,
    things: Iterable[Thing],
    surfaces: Sequence[Surface],
    begin: RelationBounds = BEGIN,
    floor_m: float | None = 0.0,
) -> Rest | None:
    """Return what a thing rests in or on; `thing.rests` is what it was held to rest in before.

    A container comes before what stands highest below the thing; the floor comes last, and not at
    all where `floor_m` is None.
    """
    others = [one for one in things if one.thing_id != thing.thing_id and not one.held_by]
    found = [
        (rank, height_m, rest)
        for rank, height_m, rest in (*_containers(thing, others, begin),
                                     *_supports(thing, others, surfaces, begin, floor_m))
    ]  # fmt: skip
    if not found:
        return None
    return max(found, key=lambda one: (one[0], one[2] == thing.rests, one[1]))[2]


def _containers(
    thing: Thing, others: Iterable[Thing], begin: RelationBounds
) -> Iterable[tuple[int, float, Rest]]:
    for other in others:
        rest = Rest(IN, other.thing_id)
        bounds = KEEP if thing.rests == rest else begin
        if (
            other.kind in CONTAINERS
            and thing.kind not in CONTAINERS
            and depth_inside_m(thing.position_m, other) >= bounds.inside_m
            and other.top_m - thing.bottom_m >= bounds.sunk_m
            and thing.bottom_m >= other.bottom_m - BELOW_CONTAINER_M
        ):
            yield 1, other.top_m, rest


def _supports(
    thing: Thing,
    others: Iterable[Thing],
    surfaces: Sequence[Surface],
    begin: RelationBounds,
    floor_m: float | None,
) -> Iterable[tuple[int, float, Rest]]:
    plates = [
        (one.thing_id, one.top_m, depth_inside_m(thing.position_m, one))
        for one in others
        if one.kind not in CONTAINERS and one.kind != ANY_CLASS
    ]
    plates += [
        (one.name, one.height_m, polygon_depth_m(thing.position_m, one.polygon_m))
        for one in surfaces
    ]
    if floor_m is not None:
        plates.append((FLOOR, floor_m, BEGIN.inside_m))
    for name, height_m, inside_m in plates:
        rest = Rest(ON, name)
        bounds = KEEP if thing.rests == rest else begin
        if inside_m >= bounds.inside_m and abs(thing.bottom_m - height_m) <= bounds.gap_m:
            yield 0, height_m, rest
