"""Say, for each skill, which of its parameters refer to something, and resolve them."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any, Final

from vla_deploy.planning.errors import NotAble, PlanInvalid, UnknownObject, UnknownPlace
from vla_deploy.planning.plan import Action
from vla_deploy.planning.references import match_place, words_of
from vla_deploy.planning.symbolic.conditions import PUT_INTO
from vla_deploy.planning.symbolic.state import Held, Pose, State
from vla_deploy.planning.symbolic.subjects import subject_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.insertions import (
    Step,
    is_surface,
    nearest_furniture,
    surface_of,
)
from vla_deploy.planning.understanding.places import is_like_place, resolve_place
from vla_deploy.planning.understanding.referents import Referent
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN

Parameters = Mapping[str, Any]
GetState = Callable[[], State]
# So near to where one stands for a table, that table is "here".
HERE_M: Final = 1.2


def grounded_steps(action: Action, resolver: Resolver, state: GetState) -> Iterator[Step]:
    """Yield an action with what it refers to resolved: several for "both cups", none if it is done.

    `state` tells what holds after the steps yielded so far.

    Raises:
        PlanningError: what it refers to is not known, or must be asked.
    """
    handle = _HANDLERS.get(action.skill)
    if handle is None:
        yield action.skill, action.parameters
        return
    yield from handle(action.parameters, resolver, state)


def _navigate(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    del state
    rest = {name: value for name, value in given.items() if name not in ("place", "object")}
    goal = given.get("place", given.get("object"))
    if not isinstance(goal, str) or ("place" in given and "object" in given):
        yield "navigate_to", given
        return
    if phrases.PRONOUNS.get(_spoken(goal)) == phrases.HERE:
        yield "navigate_to", {**_here(goal, resolver), **rest}
        return
    thing = _thing_unless_place(goal, resolver, Use.REACH)
    if thing is None:
        yield "navigate_to", {"place": resolve_place(goal, resolver), **rest}
        return
    yield from _on_furniture(thing)
    yield "navigate_to", {"object": thing.name, **rest}


def _here(text: str, resolver: Resolver) -> Parameters:
    here = resolver.setting.request.here
    if here is None:
        raise UnknownPlace(text, set(resolver.setting.request.world.places.values()))
    pose = pose_parameters(here)
    resolver.referents.note(
        text, Role.PLACE, f"{here[0]:.2f}, {here[1]:.2f}", "where the command was given"
    )
    return pose


def pose_parameters(pose: Pose) -> dict[str, float]:
    """Return a pose as parameters of a drive, to the millimetre and the milliradian."""
    x_m, y_m, yaw_rad = pose
    # Rounding must not make half a turn more than that.
    yaw_rad = min(max(round(math.remainder(yaw_rad, math.tau), 3), -3.141), 3.141)
    return {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "yaw_rad": yaw_rad}


def _spoken_there(resolver: Resolver, use: Use, *, into: bool) -> Mention | None:
    """Return what "there" was spoken of last: not what is being moved, nor what takes nothing."""
    setting = resolver.setting
    for one in setting.spoken_of():
        if use is not Use.ONTO:
            return one
        is_moved = one in setting.mentions and one.role is Role.OBJECT
        if one.role is Role.PLACE and not into:
            return one
        if not is_moved and (one.role is Role.DESTINATION or one.kind in PUT_INTO):
            return one
    return None


def _thing_unless_place(
    text: str, resolver: Resolver, use: Use, *, into: bool = False
) -> Referent | None:
    """Return the thing that a text names, None where it names a place by its name or no thing."""
    if match_place(text, resolver.setting.request.world.places):
        return None
    if phrases.PRONOUNS.get(_spoken(text)) == phrases.THERE:
        latest = _spoken_there(resolver, use, into=into)
        if latest is None or latest.role is Role.PLACE:
            return None
        text = latest.thing_id or latest.means
    try:
        return resolver.thing(text, use)
    except UnknownObject:
        if use is Use.ONTO and not is_like_place(text, resolver.setting.request.world.places):
            raise
        return None


def _see(skill: str) -> Callable[[Parameters, Resolver, GetState], Iterator[Step]]:
    def handle(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
        del state
        if not isinstance(given.get("object"), str):
            yield skill, given
            return
        thing = resolver.things(given["object"], Use.SEE)[0]
        yield from _on_furniture(thing)
        yield skill, {**given, "object": thing.name}

    return handle


def _pick(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    if not isinstance(given.get("object"), str):
        yield "pick_up", given
        return
    things = resolver.things(given["object"], Use.TAKE)
    for thing in _not_put_yet(given["object"], things, state(), resolver):
        if _held(thing, state(), resolver) is None:
            yield from _on_furniture(thing)
            yield "pick_up", {**given, "object": thing.name}


def _not_put_yet(
    text: str, things: tuple[Referent, ...], state: State, resolver: Resolver
) -> tuple[Referent, ...]:
    """Leave out of "them" what the plan has put somewhere: "put the cups down, get the keys"."""
    if phrases.PRONOUNS.get(_spoken(text)) != phrases.THEM:
        return things
    scene = resolver.setting.request.scene
    others = [one for one in things if subject_of(one.name, scene).key not in state.rests]
    return tuple(others) or things


def _place(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    put = {name: value for name, value in given.items() if name != "object"}
    things: tuple[Referent | None, ...] = (None,)
    _check_readable(given.get("destination"), resolver)
    if isinstance(given.get("object"), str):
        things = resolver.things(given["object"], Use.PUT)
    destination = _destination(given, resolver, state)
    if given.get("destination") is None:
        things = _to_put_down(things, state(), resolver)
    for thing in things:
        if thing is not None and _held(thing, state(), resolver) is None:
            if _has_put(thing, destination, state(), resolver):
                continue
            yield from _on_furniture(thing)
            yield "pick_up", {"object": thing.name, **_arm(given)}
        held = None if thing is None else _held(thing, state(), resolver)
        hand = (
            {"arm": held.hand} if held is not None and held.hand and len(state().held) > 1 else {}
        )
        yield "place", {**put, **destination, **hand}


def _hand_over(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    """Give what is held; what is not is fetched before, to where it was asked for."""
    if not isinstance(given.get("object"), str):
        yield "hand_over", given
        return
    for thing in resolver.things(given["object"], Use.PUT):
        if _held(thing, state(), resolver) is None:
            yield from _on_furniture(thing)
            yield "pick_up", {"object": thing.name, **_arm(given)}
            if resolver.setting.request.here is not None:
                yield "navigate_to", _here("here", resolver)
        held = _held(thing, state(), resolver)
        several = held is not None and held.hand and len(state().held) > 1
        yield "hand_over", {"arm": held.hand} if held is not None and several else _arm(given)


def _has_put(thing: Referent, destination: Parameters, state: State, resolver: Resolver) -> bool:
    """Tell whether the plan has put a thing there already: "take it to the box, drop it in"."""
    scene = resolver.setting.request.scene
    rest = state.rests.get(subject_of(thing.name, scene).key)
    where = str(destination.get("destination", ""))
    if rest is None or rest.of == where:
        return rest is not None
    with suppress(UnknownObject):  # a place by another name
        return rest.of == subject_of(where, scene).key
    return False


def _to_put_down(
    things: tuple[Referent | None, ...], state: State, resolver: Resolver
) -> tuple[Referent | None, ...]:
    """Return what of things is in a hand; nothing where the plan has put them down already.

    Raises:
        PlanInvalid: none of them is, and the plan has not had it.
    """
    in_hand = {_held(one, state, resolver) if one else None: one for one in things}
    held = tuple(one for where, one in in_hand.items() if one is None or where is not None)
    if things == (None,) and state.hands and not state.held and state.rests:
        return ()
    keys = [subject_of(one.name, resolver.setting.request.scene).key for one in things if one]
    if not held and not any(key in state.rests for key in keys):
        raise PlanInvalid([f"no hand holds the {things[0].words}" if things[0] else "nothing"])
    return held


def _check_readable(text: Any, resolver: Resolver) -> None:
    """Refuse an unknown destination before asking which thing shall go there.

    Raises:
        UnknownObject: it names nothing known.
    """
    if not isinstance(text, str) or phrases.PRONOUNS.get(_spoken(text)):
        return
    if not is_like_place(text, resolver.setting.request.world.places):
        read_expression(text, resolver.setting.furniture)


def _arm(given: Parameters) -> Parameters:
    return {"arm": given["arm"]} if "arm" in given else {}


def _held(thing: Referent, state: State, resolver: Resolver) -> Held | None:
    """Return the holding of a thing, which without a scene goes by its kind alone, or its hand."""
    key = subject_of(thing.name, resolver.setting.request.scene).key
    called = (one for one in state.held if one.key in (key, thing.kind))
    return next((one for one in called if thing.hand in ("", one.hand)), None)


def _destination(given: Parameters, resolver: Resolver, state: GetState) -> Parameters:
    """Return where to put it and how; without a word about it, on the nearest furniture."""
    text = given.get("destination")
    if text is not None and not isinstance(text, str):
        return {}
    relation = given.get("relation")
    if text is None or phrases.PRONOUNS.get(_spoken(text)) == phrases.HERE:
        return _put_here(text or "down", resolver, state())
    thing = _thing_unless_place(text, resolver, Use.ONTO, into=relation == "in")
    if thing is not None:
        if relation == NEXT_TO and (container := _container_of(thing, resolver)):
            resolver.referents.note(text, Role.DESTINATION, container, "that is what it is in")
            return {"destination": container, "relation": IN}
        default = "in" if thing.kind in PUT_INTO else "on"
        return {"destination": thing.name, "relation": relation or default}
    if relation == NEXT_TO:
        raise NotAble(f"I put things next to things and on furniture, not next to {text}")
    world = resolver.setting.request.world
    place = resolve_place(text, resolver)
    surface = surface_of(place, world)
    if surface != place:
        resolver.referents.note(place, Role.DESTINATION, surface, "the furniture there")
    return {"destination": surface, "relation": "on"}


def _container_of(thing: Referent, resolver: Resolver) -> str:
    """Return what a thing in the scene lies in, "" for none."""
    known = subject_of(thing.name, resolver.setting.request.scene).thing
    return known.rests.of if known and known.rests and known.rests.relation == IN else ""


def _put_here(text: str, resolver: Resolver, state: State) -> Parameters:
    world = resolver.setting.request.world
    table = state.at if is_surface(state.at, world) else nearest_furniture(state.spot, world)
    if table is None:
        raise UnknownPlace(text, set(world.places.values()))
    near = state.spot is not None and math.dist(
        state.spot, (world.sites[table].pose.x_m, world.sites[table].pose.y_m)
    ) <= HERE_M  # fmt: skip
    why = "it is here" if near or state.at == table else "the nearest furniture"
    resolver.referents.note(text, Role.DESTINATION, table, why)
    return {"destination": table, "relation": "on"}


def _on_furniture(thing: Referent) -> Iterator[Step]:
    """Go first to the furniture on which an unseen thing was said to be."""
    if thing.look_at:
        yield "navigate_to", {"place": thing.look_at}


def _spoken(text: str) -> str:
    return " ".join(words_of(text)) or text.strip().lower()


_HANDLERS: Final[Mapping[str, Callable[[Parameters, Resolver, GetState], Iterator[Step]]]] = {
    "navigate_to": _navigate,
    "find_object": _see("find_object"),
    "look_at": _see("look_at"),
    "pick_up": _pick,
    "place": _place,
    "hand_over": _hand_over,
}
