"""Find an object: in memory, on the furniture in view, then from each viewpoint of the home.

Where it was last comes first, then what was not looked at lately, the nearest first. An action
looks from each viewpoint once, also when it is tried again, and tells which it did not get to.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from vla_deploy.client.place_state import PlaceState
from vla_deploy.navigation.errors import NavigationError
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.actions.simple import speak
from vla_deploy.skills.context import Skill, SkillContext, spoken
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.drive import drive_to
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.gaze import (
    DRIVING_GAZE,
    gaze_at,
    is_out_of_reach,
    remembered,
    turn_head,
    watch_for,
)
from vla_deploy.skills.movements.looked import (
    SURELY_SEEN_M,
    furniture_of,
    staleness,
    viewpoint_names,
)
from vla_deploy.world import Query
from vla_deploy.world.memory import where_to_look

# Within it large things on furniture are recognised.
PERHAPS_SEEN_M = 2.9
NECK_RANGE_RAD = 1.7
# A way that is not much longer than the line of sight leads around no wall.
DETOUR_RATIO, DETOUR_M = 1.3, 0.6
# So near the middle of furniture is what lies on it.
ON_FURNITURE_M = 0.7
# In so short a time nobody has put anything there.
JUST_SEEN_S = 30.0
LOOKED_AT, NOT_REACHED = "looked_at", "not_reached"
GLANCE = (0.0, 0.55)
# Where the eyes sweep at a viewpoint, as (pan, tilt).
SWEEP = ((0.0, 0.85), (0.65, 0.65), (-0.65, 0.65))


def find_object(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Look for an object until it is in the scene, and say which places are left out.

    Raises:
        TryAgain: it is nowhere to be seen.
    """
    query = parse_object(parameters["object"])
    if remembered(context, query) is None:
        yield from _search(context, query)
    found = remembered(context, query)
    if found is None:
        raise TryAgain(_nowhere(context, query))
    context.tell(thing_id=found["id"], position_m=list(found["position_m"]))


def _search(context: SkillContext, query: Query) -> Skill:
    """Look around, then from one viewpoint after the other, until the object is in the scene."""
    places = context.robot.places
    shut = {view for name in context.keeps_out & places.keys() for view in places[name].viewpoints}
    done = _told(context, LOOKED_AT)
    left = {
        view: None
        for view, name in viewpoint_names(context).items()
        if view not in shut and name not in done
    }
    if shut:
        yield from speak(context, {"text": f"I leave out the {_left_out(context)}."})
    yield from _look_around(context, query, left)
    while left and remembered(context, query) is None:
        viewpoint = min(left, key=lambda one: _rank(context, query, one))
        del left[viewpoint]
        yield from _search_from(context, viewpoint, query)


def _look_around(context: SkillContext, query: Query, left: dict[Pose2D, None]) -> Skill:
    """Look ahead, then at the furniture in sight; drop the viewpoints that this makes needless."""
    if context.robot.parts.head is None:
        yield from carry(context)  # out of the view of a camera that stands fast
    in_sight = sorted(_in_sight(context, left), key=lambda one: one[0])
    if not in_sight or not _is_just_seen(context, in_sight[0][1]):
        yield from _sweep(context, query, (GLANCE,))
    for distance_m, viewpoint in in_sight:
        if remembered(context, query) is not None:
            return
        if _is_just_seen(context, viewpoint):
            continue
        yield from gaze_at(context, furniture_of(viewpoint))
        yield from watch_for(context, query)
        if distance_m < SURELY_SEEN_M:
            del left[viewpoint]
            _tell(context, LOOKED_AT, viewpoint)


def _search_from(context: SkillContext, viewpoint: Pose2D, query: Query) -> Skill:
    """Drive to a viewpoint, watching on the way, and look around from there."""
    yield from carry(context)
    yield from turn_head(context, *DRIVING_GAZE)
    try:
        yield from drive_to(
            context, viewpoint, until=lambda: remembered(context, query) is not None
        )
    except (NotPossible, TryAgain):
        if context.link.place_state is PlaceState.LOST:
            raise
        _tell(context, NOT_REACHED, viewpoint)
        return  # a viewpoint that cannot be reached now leaves the others to try
    if remembered(context, query) is None:
        _tell(context, LOOKED_AT, viewpoint)
    yield from _sweep(context, query, SWEEP)


def _sweep(
    context: SkillContext, query: Query, directions: tuple[tuple[float, float], ...]
) -> Skill:
    for pan_rad, tilt_rad in directions:
        if remembered(context, query) is not None:
            return
        yield from turn_head(context, pan_rad, tilt_rad)
        yield from watch_for(context, query)


def _in_sight(
    context: SkillContext, viewpoints: Mapping[Pose2D, None]
) -> list[tuple[float, Pose2D]]:
    """Return the viewpoints whose furniture can be seen from here, with its distance."""
    seen = []
    for viewpoint in viewpoints:
        x_m, y_m, _ = to_base(context.link.pose, furniture_of(viewpoint))
        distance_m, bearing_rad = math.hypot(x_m, y_m), math.atan2(y_m, x_m)
        if distance_m > PERHAPS_SEEN_M or abs(bearing_rad) > NECK_RANGE_RAD:
            continue
        if _way_m(context, viewpoint) < DETOUR_RATIO * distance_m + DETOUR_M:
            seen.append((distance_m, viewpoint))
    return seen


def _rank(context: SkillContext, query: Query, viewpoint: Pose2D) -> tuple[bool, bool, int, float]:
    """Return what to search by, the least first."""
    return (
        not _was_there(context, query, viewpoint),
        _is_just_seen(context, viewpoint),
        staleness(context, viewpoint),
        _way_m(context, viewpoint),
    )


def _was_there(context: SkillContext, query: Query, viewpoint: Pose2D) -> bool:
    """Return whether what is meant was seen there, even if that is long ago or it has left."""
    scene = context.link.snapshot()
    if scene is None:
        return False
    guesses = where_to_look(query, scene, {})
    return any(
        _is_on(guess.position_m[:2], viewpoint)
        for guess in guesses
        if guess.position_m is not None and not is_out_of_reach(context, guess.thing_id)
    )


def _is_just_seen(context: SkillContext, viewpoint: Pose2D) -> bool:
    """Return whether things on a viewpoint's furniture, near by, were seen a moment ago."""
    x_m, y_m, _ = to_base(context.link.pose, furniture_of(viewpoint))
    scene = context.link.snapshot() if math.hypot(x_m, y_m) < SURELY_SEEN_M else None
    return scene is not None and any(
        scene.unseen_s(one) < JUST_SEEN_S and not one.held_by and _is_on(one.xy_m, viewpoint)
        for one in scene.things
    )


def _is_on(xy_m: tuple[float, float], viewpoint: Pose2D) -> bool:
    return math.dist(xy_m, furniture_of(viewpoint)[:2]) < ON_FURNITURE_M


def _way_m(context: SkillContext, goal: Pose2D) -> float:
    pose = context.link.pose
    try:
        points = context.planner.plan((pose.x_m, pose.y_m), (goal.x_m, goal.y_m))
    except NavigationError:
        return math.inf
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _tell(context: SkillContext, key: str, viewpoint: Pose2D) -> None:
    """Have the result tell what became of a viewpoint."""
    name = viewpoint_names(context)[viewpoint]
    rest = [one for one in _told(context, NOT_REACHED) if one != name]
    context.tell(**{NOT_REACHED: rest})
    context.tell(**{key: [*_told(context, key), name]})


def _told(context: SkillContext, key: str) -> list[str]:
    """Return the viewpoints of which the acting action has told so, in earlier tries, too."""
    return list(context.data.get(context.link.acting, {}).get(key, ()))


def _left_out(context: SkillContext) -> str:
    return " and the ".join(spoken(one) for one in sorted(context.keeps_out))


def _nowhere(context: SkillContext, query: Query) -> str:
    seen = sorted({f"{one['colour']} {one['class']}" for one in context.link.objects})
    left_out = f", and left out the {_left_out(context)}" if context.keeps_out else ""
    known = {one["id"] for one in context.link.objects if one["class"] == query.kind}
    shut = any(is_out_of_reach(context, one) for one in known)
    other = "another" if shut else "a"
    beyond = ", and one is out of my reach" if shut else ""
    told = f"I cannot find {other} {query}{beyond}; I have seen: "
    looked = {"looked at": LOOKED_AT, "could not get to": NOT_REACHED}
    where = [
        f"; I {words}: {', '.join(names)}"
        for words, key in looked.items()
        if (names := _told(context, key))
    ]
    return f"{told}{', '.join(seen) or 'nothing'}{left_out}{''.join(where)}"
