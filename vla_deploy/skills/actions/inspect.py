"""Inspect a thing: look at it from two sides, and tell what was seen from each."""

import math
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.plans.knowledge import parse_object
from vla_deploy.skills.actions.navigate import refuse_kept_out
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.drive import base_of, drive_to
from vla_deploy.skills.movements.gaze import DRIVING_GAZE, kept_in_sight, remembered, see, turn_head
from vla_deploy.skills.movements.views import APART_RAD, ViewStand, next_view, view_stands

MOST_TRIES: Final = 5
"""So many stands are driven to for two views: what is on no map may hide a thing."""


def inspect(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Look at `object` from two stands around it, at least 60 degrees apart where the map lets it.

    Raises:
        TryAgain: the object has not been seen, or is seen from nowhere any more.
        NotPossible: the robot has no base, or the map leaves no place around it.
    """
    base_of(context)
    query = parse_object(str(parameters["object"]))
    known = remembered(context, query)
    if known is None:
        raise TryAgain(f"I have not seen a {query}; look for it first")
    refuse_kept_out(context, query, known["id"])
    same = parse_object(known["id"])
    left = view_stands(context, known["position_m"])
    if not left:
        raise NotPossible(f"the map leaves no place around the {query} from which I see it")
    views: list[tuple[ViewStand, dict[str, Any]]] = []
    failure: TryAgain | NotPossible | None = None
    for _ in range(MOST_TRIES):
        if not left or len(views) == 2:
            break
        stand = next_view(context, left, views[0][0] if views else None)
        left.remove(stand)
        try:
            yield from carry(context)
            yield from turn_head(context, *DRIVING_GAZE)
            yield from drive_to(context, stand.pose)
            yield from see(context, same)
        except (NotPossible, TryAgain) as error:
            failure = error
            continue
        views.append((stand, _seen(context, kept_in_sight(context, same))))
    if not views:
        raise failure or TryAgain(f"I could not look at the {query}")
    _tell(context, views, failure)


def _seen(context: SkillContext, thing: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the scene holds of a thing after a look from where the robot stands."""
    pose = context.link.pose
    return {
        "from_x_m": round(pose.x_m, 3),
        "from_y_m": round(pose.y_m, 3),
        "thing_id": thing["id"],
        "class": thing["class"],
        "colour": thing["colour"],
        "size_m": [round(float(one), 3) for one in thing["size_m"]],
        "position_m": [round(float(one), 3) for one in thing["position_m"]],
    }


def _tell(
    context: SkillContext,
    views: list[tuple[ViewStand, dict[str, Any]]],
    failure: TryAgain | NotPossible | None,
) -> None:
    """Publish the views and how they differ, and where they are not two, or not far apart."""
    sides = [seen for _, seen in views]
    context.tell(sides=sides)
    if len(views) < 2:
        context.note(f"seen from one side only: {failure or 'there is no other place to stand'}")
        return
    first, second = sides
    at = first["position_m"]
    bearings = [math.atan2(one["from_y_m"] - at[1], one["from_x_m"] - at[0]) for one in sides]
    apart_rad = abs(math.remainder(bearings[1] - bearings[0], 2.0 * math.pi))
    differs_m = math.dist(at, second["position_m"])
    context.tell(apart_rad=round(apart_rad, 3), position_difference_m=round(differs_m, 3))
    told = f"seen from two sides, {math.degrees(apart_rad):.0f} degrees apart"
    if apart_rad < APART_RAD:
        told += f"; no further: {failure or 'the map leaves no such place to stand'}"
    if first["colour"] != second["colour"] or first["class"] != second["class"]:
        words = (f"{one['colour']} {one['class']}" for one in sides)
        told += f"; from one side a {', from the other a '.join(words)}"
    context.note(told)
