"""Choose what is put on a table for so many people, of what there is."""

from collections.abc import Mapping
from typing import Final

from vla_deploy.manipulation.errors import TooWide
from vla_deploy.manipulation.grasps import SIZE_DOUBT_M, require_fit
from vla_deploy.plans.knowledge import World, match_place
from vla_deploy.plans.plan import Skill
from vla_deploy.world import Snapshot, Thing
from vla_deploy.world.resting import IN, ON

PEOPLE: Final[Mapping[str, int]] = {"me": 1, "one": 1, "two": 2, "us": 2}
DEFAULT: Final = "two"
EACH: Final = ("cup", "bowl")
"""What everybody gets, as far as there is one; of a bottle all have one."""
SHARED: Final = ("bottle",)
MOST_THINGS: Final = 4


def set_table(where: str, people: str, world: World, scene: Snapshot | None) -> list[Skill]:
    """Return actions that put cups, bowls and a bottle onto a table; a cup where none is known.

    `where` are words for the table, `people` is a word of PEOPLE. What stands there counts.
    """
    things = () if scene is None else scene.things
    name, count = match_place(where, world.places), PEOPLE[people]
    there = frozenset() if name is None else world.surfaces_of(name)
    put: list[str] = []
    is_set = False
    for kind in (*EACH, *SHARED):
        alike = [one for one in things if one.kind == kind]
        set_already = [one for one in alike if one.rests is not None and one.rests.of in there]
        free = [one.thing_id for one in alike if one not in set_already and _is_free(one, world)]
        is_set = is_set or bool(set_already)
        wanted = (count if kind in EACH else 1) - len(set_already)
        put += free[: max(0, wanted)]
    if is_set and not put:
        return [("speak", {"text": "All that I know of for the table is there already."})]
    names = put[:MOST_THINGS] or ["cup"]
    return [("place", {"object": one, "destination": where, "relation": ON}) for one in names]


def _is_free(thing: Thing, world: World) -> bool:
    """Return whether a thing may be taken: not out of a box, nor with hands too small for it."""
    is_inside = thing.rests is not None and thing.rests.relation == IN
    return not is_inside and not is_too_wide(thing, world)


def is_too_wide(thing: Thing, world: World) -> bool:
    """Return whether no hand of the robot opens wide enough for a thing."""
    if world.opening_max_m is None:
        return False
    try:
        require_fit(thing.kind, thing.size_m, world.opening_max_m, SIZE_DOUBT_M)
    except TooWide:
        return True
    return False
