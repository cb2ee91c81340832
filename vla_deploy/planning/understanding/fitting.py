"""Find the things of a scene that an expression fits, and that can play the part asked of them."""

from dataclasses import replace
from enum import StrEnum

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import DependsOnView
from vla_deploy.planning.understanding.expressions import Expression
from vla_deploy.planning.understanding.selection import facing, most, on_side
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world import Query, Thing, find
from vla_deploy.world.query import FROM_A_VIEW
from vla_deploy.world.vocabulary import ANY_CLASS, OBJECT_CLASSES


class Use(StrEnum):
    """Say what a command wants of a thing: to see it, take it, put it, put something onto it."""

    SEE = "see"
    TAKE = "take"
    PUT = "put"
    ONTO = "onto"


def fitting(read: Expression, use: Use, setting: Setting) -> list[Thing]:
    """Return the things that fit, the nearest first.

    Raises:
        DependsOnView: it says left, right, in front or behind, and nobody knows who looks at what.
    """
    query, view = read.query, setting.view
    if query.relation in FROM_A_VIEW and (view is None or setting.request.scene is None):
        raise DependsOnView(read.said, OBJECT_CLASSES)
    if not query.is_named and not query.thing_id:
        query = replace(query, kind=_kind_spoken_of(query, setting))
    found = [one for one in find(query, setting.scene, view) if suits(one, use, query, setting)]
    if read.support:
        found = [one for one in found if one.rests and one.rests.of in read.support]
    if read.is_other:
        before = setting.latest_id(read.query)
        found = [one for one in found if before is None or not one.is_called(before)]
    if read.side:
        looks = facing(view) if read.by_speaker and view is not None else view
        found = on_side(found, read.side, looks)
    return most(found, read.extreme) if read.extreme else found


def suits(thing: Thing, use: Use, query: Query, setting: Setting) -> bool:
    """Tell whether a thing can play its part: what is held is not taken, nor put upon."""
    may_move = query.kind != ANY_CLASS or thing.kind in GRASPABLE_CLASSES
    match use:
        case Use.ONTO:
            return not thing.held_by and not setting.is_object_here(thing)
        case Use.TAKE:
            return may_move and (not thing.held_by or bool(query.thing_id))
        case Use.PUT:
            return may_move
        case Use.SEE:
            return True


def _kind_spoken_of(query: Query, setting: Setting) -> str:
    """Return the kind that "the red one" means after "the cups": the last of which one is red."""
    for one in setting.spoken_of():
        if one.kind and find(replace(query, kind=one.kind), setting.scene, setting.view):
            return one.kind
    return ANY_CLASS
