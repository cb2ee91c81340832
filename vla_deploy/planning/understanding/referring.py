"""Say, for each skill, which of its parameters refer to something, and resolve them."""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Final

from vla_deploy.planning.errors import PlanInvalid, UnknownObject, UnknownPlace
from vla_deploy.planning.plan import Action
from vla_deploy.planning.symbolic.state import Held, Pose, State, subject_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.places import (
    GetState,
    Parameters,
    check_readable,
    destination_of,
    pronoun_of,
    resolve_place,
    thing_unless_place,
)
from vla_deploy.planning.understanding.resolver import Referent, Resolver

Step = tuple[str, Parameters]


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


def _navigate(given: Parameters, resolver: Resolver, _: GetState) -> Iterator[Step]:
    rest = {name: value for name, value in given.items() if name not in ("place", "object")}
    goal = given.get("place", given.get("object"))
    if not isinstance(goal, str) or ("place" in given and "object" in given):
        yield "navigate_to", given
        return
    if pronoun_of(goal) == phrases.HERE:
        yield "navigate_to", {**_here(goal, resolver), **rest}
        return
    thing = thing_unless_place(goal, resolver, Use.REACH)
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
    resolver.note(text, f"{here[0]:.2f}, {here[1]:.2f}", "where the command was given")
    return pose


def pose_parameters(pose: Pose) -> dict[str, float]:
    """Return a pose as parameters of a drive, to the millimetre and the milliradian."""
    x_m, y_m, yaw_rad = pose
    # Rounding must not make half a turn more than that.
    yaw_rad = min(max(round(math.remainder(yaw_rad, math.tau), 3), -3.141), 3.141)
    return {"x_m": round(x_m, 3), "y_m": round(y_m, 3), "yaw_rad": yaw_rad}


def _see(skill: str) -> Callable[[Parameters, Resolver, GetState], Iterator[Step]]:
    def handle(given: Parameters, resolver: Resolver, _: GetState) -> Iterator[Step]:
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
    if pronoun_of(text) != phrases.THEM:
        return things
    scene = resolver.setting.request.scene
    others = [one for one in things if subject_of(one.name, scene).key not in state.rests]
    return tuple(others) or things


def _place(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    put = {name: value for name, value in given.items() if name != "object"}
    things: tuple[Referent | None, ...] = (None,)
    check_readable(given.get("destination"), resolver)
    if isinstance(given.get("object"), str):
        things = resolver.things(given["object"], Use.PUT)
    destination = destination_of(given, resolver, state)
    if given.get("destination") is None:
        things = _to_put_down(things, state(), resolver)
    for thing in things:
        if thing is not None and _held(thing, state(), resolver) is None:
            if _has_put(thing, destination, state(), resolver):
                continue
            yield from _on_furniture(thing)
            yield "pick_up", {"object": thing.name, **_arm(given)}
        held = None if thing is None else _held(thing, state(), resolver)
        yield "place", {**put, **destination, **_hand_of(held, state())}


def _hand_over(given: Parameters, resolver: Resolver, state: GetState) -> Iterator[Step]:
    """Give what is held; what is not is fetched before, to where it was asked for."""
    if not isinstance(given.get("object"), str):
        yield "hand_over", given
        return
    things = list(resolver.things(given["object"], Use.PUT))
    while things:
        missing = [one for one in things if _held(one, state(), resolver) is None]
        fetched = missing[: max(1, state().free_hands())]
        for thing in fetched:
            yield from _on_furniture(thing)
            yield "pick_up", {"object": thing.name, **_arm(given)}
        if fetched and resolver.setting.request.here is not None:
            yield "navigate_to", _here("here", resolver)
        in_hand = [one for one in things if _held(one, state(), resolver) is not None]
        for thing in in_hand or fetched:
            held = _held(thing, state(), resolver)
            yield "hand_over", _hand_of(held, state()) or _arm(given)
            things.remove(thing)


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


def _arm(given: Parameters) -> Parameters:
    return {"arm": given["arm"]} if "arm" in given else {}


def _hand_of(held: Held | None, state: State) -> Parameters:
    """Name the hand that holds a thing where another holds something, too."""
    is_named = held is not None and held.hand and len(state.held) > 1
    return {"arm": held.hand} if held is not None and is_named else {}


def _held(thing: Referent, state: State, resolver: Resolver) -> Held | None:
    """Return the holding of a thing, which without a scene goes by its kind alone, or its hand."""
    key = subject_of(thing.name, resolver.setting.request.scene).key
    called = (one for one in state.held if one.key in (key, thing.kind))
    return next((one for one in called if thing.hand in ("", one.hand)), None)


def _on_furniture(thing: Referent) -> Iterator[Step]:
    """Go first to the furniture on which an unseen thing was said to be."""
    if thing.look_at:
        yield "navigate_to", {"place": thing.look_at}


_HANDLERS: Final[Mapping[str, Callable[[Parameters, Resolver, GetState], Iterator[Step]]]] = {
    "navigate_to": _navigate,
    "find_object": _see("find_object"),
    "look_at": _see("look_at"),
    "pick_up": _pick,
    "place": _place,
    "hand_over": _hand_over,
}
