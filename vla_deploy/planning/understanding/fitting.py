"""Find the things of a scene that an expression fits, and that can play the part asked of them."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import pairwise
from typing import Final

from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding.conversation import Mention, MentionRole
from vla_deploy.planning.understanding.expressions import Expression, Scope, read_expression
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES
from vla_deploy.plans.errors import DependsOnView
from vla_deploy.world import Query, Snapshot, Thing, Viewpoint, find
from vla_deploy.world.access import GraspStand, grasp_stand
from vla_deploy.world.query import FROM_A_VIEW, ORDERS
from vla_deploy.world.resting import IN
from vla_deploy.world.vocabulary import ANY_CLASS

LEAST_BEARING_RAD: Final = 0.03
"""Things whose bearings differ by less stand one behind the other, not side by side."""


@dataclass(slots=True)
class CommandContext:
    """Remember, over one command, what has been mentioned; everything else is the request's."""

    request: PlanRequest
    mentions: list[Mention] = field(default_factory=list)

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

    def read(self, text: str) -> Expression:
        """Read an expression, or in its place what the speaker has answered that it means.

        Raises:
            UnknownObject: it says nothing that the robot knows.
        """
        places, named = self.request.world.places, self.request.world.furniture
        furniture = {name: one for name, one in places.items() if not named or one in named}
        read = read_expression(text, furniture)
        answer = self.request.conversation.choices.get(read.said)
        if answer is None:
            return read
        return replace(read_expression(answer, furniture), scope=Scope.ONE)

    def spoken_of(self) -> tuple[Mention, ...]:
        """Return what was mentioned, in this command first, the newest first."""
        return (*reversed(self.mentions), *self.request.conversation.mentions())

    def latest_group(self) -> tuple[Mention, ...]:
        """Return the objects of the newest turn that mentioned any."""
        turns = reversed(self.request.conversation.turns)
        for mentioned in (tuple(self.mentions), *(turn.mentioned for turn in turns)):
            objects = tuple(one for one in mentioned if one.role is MentionRole.OBJECT)
            if objects:
                return tuple(dict.fromkeys(objects))
        return ()

    def holding(self) -> Iterator[tuple[str, Mention]]:
        """Yield each hand that holds something, with what it holds."""
        seen = {one.held_by: one for one in self.scene.things if one.held_by}
        for hand, thing in seen.items():
            yield hand, Mention.of(thing)
        for hand, kind in self.request.world.holding.items():
            if kind and hand not in seen:
                yield hand, Mention(said=kind, means=kind, kind=kind)


class ThingUse(StrEnum):
    """Say what a command wants of a thing: see, reach, take or put it, or put onto it."""

    SEE = "see"
    REACH = "reach"
    TAKE = "take"
    PUT = "put"
    ONTO = "onto"


def fitting(read: Expression, use: ThingUse, context: CommandContext) -> list[Thing]:
    """Return the things that fit, the nearest first.

    Raises:
        DependsOnView: it says left, right, in front or behind, and nobody knows who looks at what.
    """
    query, scene, view = read.query, context.scene, context.view
    if not (query.is_named or query.thing_id):
        query = replace(query, kind=_kind_spoken_of(query, use, context))
    if query.relation in FROM_A_VIEW and (view is None or context.request.scene is None):
        raise DependsOnView(read.said)
    found = find(replace(query, order=""), scene, view) or _in_room(query, context)
    if read.is_other:
        if use is ThingUse.PUT and not read.query.is_named:
            found = [one for one in scene.things if one.held_by] or found
        spoken = (one for one in context.spoken_of() if query.kind in (ANY_CLASS, one.kind))
        before = next((one.thing_id for one in spoken if one.thing_id), "")
        if not before and read.scope is Scope.ALL:
            return []  # than which one?
        found = [one for one in found if not before or not one.is_called(before)]
    found = [one for one in found if _suits(one, use, query, context)]
    if read.held_by:
        found = [one for one in found if one.held_by in read.held_by]
    for other in read.besides:
        known = find(replace(other.query, order=""), scene, view)
        there = [one for one in _supported(read, found) if one in known]
        meant = _told_apart(other, there, view)
        found = [one for one in found if one not in meant]
    return _told_apart(read, found, view)


def _suits(thing: Thing, use: ThingUse, query: Query, context: CommandContext) -> bool:
    """Return whether a thing can play its part: what is held is not taken, nor put upon.

    What nobody can get at is put upon only where it is meant by its id.
    """
    may_move = query.kind != ANY_CLASS or thing.kind in GRASPABLE_CLASSES
    match use:
        case ThingUse.ONTO:
            moved = [one.thing_id for one in context.mentions if one.role is MentionRole.OBJECT]
            world = context.request.world
            stand = grasp_stand(thing, context.view, world.is_free, world.reach)
            is_meant = bool(query.thing_id) or stand is not GraspStand.NONE
            return not thing.held_by and thing.thing_id not in moved and is_meant
        case ThingUse.TAKE:
            return may_move and (not thing.held_by or bool(query.thing_id))
        case ThingUse.PUT:
            return may_move
        case ThingUse.SEE | ThingUse.REACH:
            return True


def _kind_spoken_of(query: Query, use: ThingUse, context: CommandContext) -> str:
    """Return the kind that "the red one" means after "the cups": the last of which one is red."""
    for one in context.spoken_of():
        if not one.kind or (
            use in (ThingUse.TAKE, ThingUse.PUT) and one.kind not in GRASPABLE_CLASSES
        ):
            continue
        if find(replace(query, kind=one.kind), context.scene, context.view):
            return one.kind
    return ANY_CLASS


def _in_room(query: Query, context: CommandContext) -> list[Thing]:
    """Return what stands on the furniture of a room, where "in the kitchen" names no furniture."""
    room = query.anchor.surface if query.anchor is not None and query.relation == IN else ""
    there = context.request.world.surfaces_of(room) if room else ()
    alone = find(replace(query, relation="", anchor=None, order=""), context.scene, context.view)
    return [one for one in alone if _rests_on(one, there)]


def _rests_on(thing: Thing, names: Collection[str]) -> bool:
    return thing.rests is not None and thing.rests.of in names


# --- what tells things apart that are alike -----------------------------------------------------


def _told_apart(read: Expression, things: list[Thing], view: Viewpoint | None) -> list[Thing]:
    """Return of things that are alike those on a support, at a side, or the nearest."""
    found = _supported(read, things)
    if read.side:
        found = _on_side(found, read.side, view)
    if read.query.order and view is not None:
        found = found[:1] if ORDERS[read.query.order] > 0 else found[-1:]
    return found


def _supported(read: Expression, things: list[Thing]) -> list[Thing]:
    return [one for one in things if _rests_on(one, read.support)] if read.support else things


def _on_side(things: list[Thing], side: str, view: Viewpoint | None) -> list[Thing]:
    """Return the leftmost, rightmost or middle thing; all of them where they are in no one row."""
    row = in_a_row(things, view) if len({one.rests for one in things}) == 1 else None
    if row is None or (side == "middle" and len(row) % 2 == 0):
        return things
    return [row[{"left": 0, "right": -1, "middle": len(row) // 2}[side]]]


def in_a_row(things: Sequence[Thing], view: Viewpoint | None) -> list[Thing] | None:
    """Return things from left to right as they are seen, None where they are not side by side."""
    if view is None or len(things) < 2:
        return None
    row = sorted(things, key=lambda thing: -_bearing_rad(thing, view))
    bearings = [_bearing_rad(thing, view) for thing in row]
    apart = all(left - right > LEAST_BEARING_RAD for left, right in pairwise(bearings))
    return row if apart else None


def _bearing_rad(thing: Thing, view: Viewpoint) -> float:
    """Return how far to the left of straight ahead a thing is seen."""
    angle = math.atan2(thing.xy_m[1] - view.y_m, thing.xy_m[0] - view.x_m) - view.yaw_rad
    return math.remainder(angle, math.tau)
