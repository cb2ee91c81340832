"""Turn the head and see: look in a direction, at a point, and wait for fresh sightings."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, NotThere, TryAgain
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.looked import note_looked
from vla_deploy.skills.movements.motion import move_joints, settle, wait_until
from vla_deploy.world import Query, Viewpoint, read_snapshot

DIRECTIONS: Mapping[str, tuple[float, float]] = {
    "ahead": (0.0, 0.2),
    "left": (1.2, 0.2),
    "right": (-1.2, 0.2),
    "up": (0.0, -0.4),
    "down": (0.0, 0.9),
}
DRIVING_GAZE = (0.0, 0.3)
HEAD_SPEED_RATIO = 0.75
"""A light head behind setpoints of every tick turns faster and slower by a fifth than they do."""
FRESH_TIMEOUT_S = 4.0
SIGHTINGS = 2
WATCH_TIMEOUT_S = 2.0
# Two images at the camera's rate: perception wants to see a thing twice.
CONFIRMED_S = 0.4
MEMORY_S = 600.0
SURE_CONFIDENCE = 0.3
OUT_OF_REACH_S = 120.0
"""So long another one is looked for: what nobody can get at may be no thing at all."""


def look_at(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Look at a known object or in a named direction.

    Raises:
        NotPossible: the camera stands fast, and a direction is asked for.
        TryAgain: the object has not been seen.
    """
    if "direction" in parameters:
        if context.robot.parts.head is None:
            raise NotPossible("my camera stands fast: I have no head to turn")
        yield from turn_head(context, *DIRECTIONS[parameters["direction"]])
        note_looked(context)
        return
    query = parse_object(parameters["object"])
    target = remembered(context, query)
    if target is None:
        raise TryAgain(f"I have not seen a {query}; look for it first")
    yield from gaze_at(context, target["position_m"])


def turn_head(context: SkillContext, pan_rad: float, tilt_rad: float) -> Skill:
    """Turn the head as far towards a direction as its joints allow; without one, do nothing."""
    head = context.robot.parts.head
    if head is None:
        return
    limits = context.robot.limits
    targets = {
        name: min(max(angle, limits[name].min), limits[name].max)
        for name, angle in ((head.pan, pan_rad), (head.tilt, tilt_rad))
    }
    yield from move_joints(context, targets, HEAD_SPEED_RATIO)
    yield from settle(context, tuple(targets))


def gaze_at(context: SkillContext, position_m: Any) -> Skill:
    """Look at a point of the map frame."""
    x_m, y_m, z_m = to_base(context.link.pose, position_m)
    eye_m = next(iter(context.arms.values())).camera_pose(context.link.positions)[:3, 3]
    tilt_rad = math.atan2(eye_m[2] - z_m, math.hypot(x_m, y_m) - math.hypot(*eye_m[:2]))
    yield from turn_head(context, math.atan2(y_m, x_m), tilt_rad)


def remembered(context: SkillContext, query: Query) -> Mapping[str, Any] | None:
    """Return the nearest object meant that was seen surely and within MEMORY_S, or None.

    What has just proved to be out of reach counts only where it is meant by its id.
    """
    now_ns = context.link.clock.now_ns()
    objects = context.link.objects
    if not objects:
        return None
    snapshot = read_snapshot({"stamp_ns": now_ns, "objects": objects})
    pose = context.link.pose
    here = Viewpoint(x_m=pose.x_m, y_m=pose.y_m, yaw_rad=pose.yaw_rad)
    for thing in query.among(snapshot, here):
        if not query.thing_id and is_out_of_reach(context, thing.thing_id):
            continue
        if thing.confidence >= SURE_CONFIDENCE and snapshot.unseen_s(thing) <= MEMORY_S:
            return next(one for one in objects if one["id"] == thing.thing_id)
    return None


def is_out_of_reach(context: SkillContext, thing_id: str) -> bool:
    """Return whether no place was found, a short while ago, from which to take a thing."""
    since_ns = context.out_of_reach.get(thing_id)
    return (
        since_ns is not None and context.link.clock.now_ns() - since_ns < OUT_OF_REACH_S * NS_PER_S
    )


def kept_in_sight(context: SkillContext, query: Query) -> Mapping[str, Any]:
    """Return the object that `remembered` finds.

    Raises:
        TryAgain: it finds none.
    """
    seen = remembered(context, query)
    if seen is None:
        raise TryAgain(f"I lost sight of the {query}")
    return seen


def see(context: SkillContext, query: Query) -> Skill:
    """Look at an object until it has been seen afresh; read it with `remembered` afterwards.

    Raises:
        NotThere: it is not where it was.
        TryAgain: it has not been seen.
    """
    known = remembered(context, query)
    if known is None:
        raise TryAgain(f"I have not seen a {query}; look for it first")
    yield from gaze_at(context, known["position_m"])
    started_ns = context.link.clock.now_ns()
    seen_before = int(known["seen_count"])

    def fresh() -> bool:
        now = remembered(context, query)
        return (
            now is not None
            and int(now["last_seen_ns"]) > started_ns
            and (int(now["seen_count"]) >= seen_before + SIGHTINGS or now["id"] != known["id"])
        )

    yield from wait_until(context, fresh, FRESH_TIMEOUT_S)
    if not fresh():
        raise NotThere(f"the {query} is no longer where I saw it")


def watch(context: SkillContext) -> Skill:
    """Wait until enough images have been judged to confirm what is in view."""
    yield from wait_until(
        context, partial(_looked, context, context.link.clock.now_ns()), WATCH_TIMEOUT_S
    )


def watch_for(context: SkillContext, query: Query) -> Skill:
    """Wait until an object is seen, or until enough images show that it is not in view."""
    looked = partial(_looked, context, context.link.clock.now_ns())
    yield from wait_until(
        context, lambda: looked() or remembered(context, query) is not None, WATCH_TIMEOUT_S
    )
    note_looked(context)


def _looked(context: SkillContext, since_ns: int) -> bool:
    """Return whether perception has judged enough images taken after a moment to confirm things."""
    return context.link.scene_stamp_ns > since_ns + round(CONFIRMED_S * NS_PER_S)
