"""Find what a plan leaves out before an action: looking for it, going there, a free hand."""

import math
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Action
from vla_deploy.planning.symbolic.conditions import (
    MET,
    Setting,
    has_free_hand,
    is_before,
    is_known,
)
from vla_deploy.planning.symbolic.state import Point, State

Step = tuple[str, Mapping[str, Any]]
# These skills want the robot before the thing, those only want it known.
FROM_CLOSE: Final = frozenset({"pick_up", "place"})
OF_THINGS: Final = frozenset({"navigate_to", "look_at", *FROM_CLOSE})


def missing_before(action: Action, state: State, request: Request) -> Step | None:
    """Return the first step that must still come before an action, or None."""
    if action.skill not in OF_THINGS:
        return None
    setting = Setting(parameters=action.parameters, world=request.world, scene=request.scene)
    if action.skill == "pick_up" and has_free_hand(state, setting):
        return _towards_free_hand(action, state, request.world)
    subject = setting.subject("object") or setting.subject("destination")
    name = action.parameters.get("object", action.parameters.get("destination"))
    if subject is not None and is_known(state, setting) != MET:
        return "find_object", {"object": name}
    if action.skill in FROM_CLOSE and is_before(state, setting) != MET:
        return "navigate_to", {"object" if subject is not None else "place": name}
    return None


def _towards_free_hand(action: Action, state: State, world: World) -> Step | None:
    """Put down what a hand holds, on the nearest furniture; None where there is none."""
    table = nearest_furniture(state.spot, world)
    arm = action.parameters.get("arm")
    held = next((one for one in state.held if arm in (None, one.hand)), None)
    if table is None or held is None:
        return None
    if state.at != table:
        return "navigate_to", {"place": table}
    put = {"destination": table, "relation": "on"}
    return "place", {**put, "arm": held.hand} if held.hand else put


def nearest_furniture(spot: Point | None, world: World) -> str | None:
    """Return the place with something to put things on that is nearest, or None."""
    names = [name for name in world.sites if is_surface(name, world)]
    if spot is None:
        return names[0] if names else None
    return min(names, key=lambda name: math.dist(spot, _site(name, world)), default=None)


def is_surface(name: str, world: World) -> bool:
    """Tell whether one stands before furniture at a place itself, not elsewhere in the room."""
    site = world.sites.get(name)
    return site is not None and site.pose in site.viewpoints


def surface_of(name: str, world: World) -> str:
    """Return the furniture that putting something "in the kitchen" means, or the place itself."""
    site = world.sites.get(name)
    if site is None or not site.viewpoints or is_surface(name, world):
        return name
    return next(
        (one for one, other in world.sites.items() if other.pose == site.viewpoints[0]), name
    )


def _site(name: str, world: World) -> Point:
    pose = world.sites[name].pose
    return pose.x_m, pose.y_m
