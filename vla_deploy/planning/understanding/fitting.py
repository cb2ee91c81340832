"""Find the things of a scene that an expression fits, and that can play the part asked of them."""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from enum import StrEnum

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import DependsOnView
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expressions import Expression, Scope
from vla_deploy.planning.understanding.selection import by_distance, in_place, most, on_side
from vla_deploy.world import Query, Snapshot, Thing, Viewpoint, find
from vla_deploy.world.query import FROM_A_VIEW, ORDERS
from vla_deploy.world.resting import IN
from vla_deploy.world.vocabulary import ANY_CLASS


@dataclass(slots=True)
class Setting:
    """Remember, over one command, what has been mentioned; everything else is the request's."""

    request: Request
    mentions: list[Mention] = field(default_factory=list)
    furniture: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Gather what furniture may be called."""
        world = self.request.world
        named = world.furniture or frozenset(world.places.values())
        self.furniture = {name: one for name, one in world.places.items() if one in named}

    @property
    def scene(self) -> Snapshot:
        """Return the scene, an empty one where none is told."""
        return self.request.scene or Snapshot(stamp_ns=0, things=())

    @property
    def view(self) -> Viewpoint | None:
        """Return from where the robot looks, None where its pose is not known."""
        here = self.request.here
        if here is not None:
            return Viewpoint(x_m=here[0], y_m=here[1], yaw_rad=here[2])
        return self.scene.robot

    def spoken_of(self) -> tuple[Mention, ...]:
        """Return what was mentioned, in this command first, the newest first."""
        return (*reversed(self.mentions), *self.request.conversation.mentions())

    def latest_group(self) -> tuple[Mention, ...]:
        """Return the objects of the newest turn that mentioned any."""
        turns = reversed(self.request.conversation.turns)
        for mentioned in (tuple(self.mentions), *(turn.mentioned for turn in turns)):
            objects = tuple(one for one in mentioned if one.role is Role.OBJECT)
            if objects:
                return tuple(dict.fromkeys(objects))
        return ()

    def held(self) -> Mention | None:
        """Return what a hand holds, None where that is nothing or more than one thing."""
        found = list(self.holding())
        return found[0][1] if len(found) == 1 else None

    def holding(self) -> Iterator[tuple[str, Mention]]:
        """Yield each hand that holds something, with what it holds."""
        seen = [one for one in self.scene.things if one.held_by]
        for thing in seen:
            yield thing.held_by, Mention.of(thing)
        for hand, kind in self.request.world.holding.items():
            if kind and not any(one.held_by == hand for one in seen):
                yield hand, Mention(said=kind, means=kind, kind=kind)


class Use(StrEnum):
    """Say what a command wants of a thing: see, reach, take or put it, or put onto it."""

    SEE = "see"
    REACH = "reach"
    TAKE = "take"
    PUT = "put"
    ONTO = "onto"


def fitting(read: Expression, use: Use, setting: Setting) -> list[Thing]:
    """Return the things that fit, the nearest first.

    Raises:
        DependsOnView: it says left, right, in front or behind, and nobody knows who looks at what.
    """
    found = _told_apart(read, alike(read, use, setting), setting)
    return [one for one in found if suits(one, use, _query(read, use, setting), setting)]


def alike(read: Expression, use: Use, setting: Setting) -> list[Thing]:
    """Return what fits but for what compares things: a side, a place in a row, an extreme.

    Raises:
        DependsOnView: as `fitting`.
    """
    query, view = _query(read, use, setting), setting.view
    if query.relation in FROM_A_VIEW and (view is None or setting.request.scene is None):
        raise DependsOnView(read.said)
    found = find(replace(query, order=""), setting.scene, view)
    found = found or _in_room(query, setting)
    if read.is_other and use is Use.PUT and not read.query.is_named:
        found = [one for one in setting.scene.things if one.held_by] or found
    if not read.nth:
        found = [one for one in found if suits(one, use, query, setting)]
    else:  # what cannot be taken is counted all the same
        found = [one for one in found if not one.held_by]
    if read.support:
        found = [one for one in found if _rests_on(one, read.support)]
    if read.is_other:
        spoken = (one for one in setting.spoken_of() if query.kind in (ANY_CLASS, one.kind))
        before = next((one.thing_id for one in spoken if one.thing_id), "")
        found = [one for one in found if not before or not one.is_called(before)]
    for other in read.besides:
        meant = _described_by(other, found, setting)
        found = [one for one in found if one not in meant]
    return found


def suits(thing: Thing, use: Use, query: Query, setting: Setting) -> bool:
    """Tell whether a thing can play its part: what is held is not taken, nor put upon."""
    may_move = query.kind != ANY_CLASS or thing.kind in GRASPABLE_CLASSES
    match use:
        case Use.ONTO:
            moved = [one.thing_id for one in setting.mentions if one.role is Role.OBJECT]
            return not thing.held_by and thing.thing_id not in moved
        case Use.TAKE:
            return may_move and (not thing.held_by or bool(query.thing_id))
        case Use.PUT:
            return may_move
        case Use.SEE | Use.REACH:
            return True


def _query(read: Expression, use: Use, setting: Setting) -> Query:
    query = read.query
    is_first_of_what = bool(read.nth) and not read.side
    if query.is_named or query.thing_id or is_first_of_what:
        return query
    return replace(query, kind=_kind_spoken_of(query, use, setting))


def _kind_spoken_of(query: Query, use: Use, setting: Setting) -> str:
    """Return the kind that "the red one" means after "the cups": the last of which one is red."""
    for one in setting.spoken_of():
        if not one.kind or (use in (Use.TAKE, Use.PUT) and one.kind not in GRASPABLE_CLASSES):
            continue
        if find(replace(query, kind=one.kind), setting.scene, setting.view):
            return one.kind
    return ANY_CLASS


def _in_room(query: Query, setting: Setting) -> list[Thing]:
    """Return what stands on the furniture of a room, where "in the kitchen" names no furniture."""
    world = setting.request.world
    room = query.anchor.surface if query.anchor is not None and query.relation == IN else ""
    table = world.surface_of(room) if room else ""
    if table in ("", room):
        return []
    there = {table, *(one.thing_id for one in setting.scene.things if _rests_on(one, {table}))}
    alone = find(replace(query, relation="", anchor=None, order=""), setting.scene)
    return [one for one in alone if _rests_on(one, there)]


def _rests_on(thing: Thing, names: Collection[str]) -> bool:
    return thing.rests is not None and thing.rests.of in names


# --- what tells things apart that are alike -----------------------------------------------------


def _told_apart(read: Expression, found: list[Thing], setting: Setting) -> list[Thing]:
    """Return of things that are alike the one at a side, a place in a row, or an extreme."""
    view = setting.view
    if read.among and len(found) not in (1, read.among):
        return found
    if read.near is not None:
        return _by_nearness(read, read.near, found, setting)
    if read.nth:
        return in_place(found, read.nth, read.side, view)
    if read.side:
        found = on_side(found, read.side, view)
    if read.extreme:
        return most(found, read.extreme)
    if read.query.order and view is not None:
        found = by_distance(found, (view.x_m, view.y_m))
        return found[:1] if ORDERS[read.query.order] > 0 else found[-1:]
    return found


def _described_by(read: Expression, things: list[Thing], setting: Setting) -> list[Thing]:
    """Return those of some things that a part such as "the red one" describes."""
    known = find(replace(read.query, order=""), setting.scene, setting.view)
    found = [one for one in things if one in known]
    if read.support:
        found = [one for one in found if _rests_on(one, read.support)]
    return _told_apart(read, found, setting)


def _by_nearness(
    read: Expression, near: Expression, found: list[Thing], setting: Setting
) -> list[Thing]:
    """Return the nearest to another thing, or the farthest; none where that is not known."""
    others = _described_by(near, list(setting.scene.things), setting)
    if not others or (len(others) > 1 and near.scope is not Scope.ALL):
        return found if others else []
    row = [one for one in found if one not in others]
    row.sort(key=lambda one: min(math.dist(one.xy_m, other.xy_m) for other in others))
    return row[:1] if ORDERS[read.order] > 0 else row[-1:]
