"""Turn the head and see: look in a direction, at a point, and wait for fresh sightings."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.planning.references import ObjectQuery, parse_object
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import TryAgain
from vla_deploy.skills.frames import to_base
from vla_deploy.skills.motion import move_joints, settle, wait_until

PAN, TILT = "head_pan", "head_tilt"
HEAD_JOINTS = (PAN, TILT)
DIRECTIONS: Mapping[str, tuple[float, float]] = {
    "ahead": (0.0, 0.2),
    "left": (1.2, 0.2),
    "right": (-1.2, 0.2),
    "up": (0.0, -0.4),
    "down": (0.0, 0.9),
}
# Where the eyes sweep, as (pan, tilt), to cover the tables in front of the robot.
SWEEP = ((0.0, 0.55), (0.7, 0.5), (-0.7, 0.5), (0.0, 0.95))
FRESH_TIMEOUT_S = 4.0
SIGHTINGS = 2
SWEEP_TIMEOUT_S = 2.0
# Two images at the camera's rate: perception wants to see a thing twice.
CONFIRMED_S = 0.4
MEMORY_S = 120.0


def look_at(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Look at a known object or in a named direction."""
    if "direction" in parameters:
        yield from turn_head(context, *DIRECTIONS[parameters["direction"]])
        return
    query = parse_object(parameters["object"])
    target = remembered(context, query)
    if target is None:
        raise TryAgain(f"I have not seen a {query}; look for it first")
    yield from gaze_at(context, target["position_m"])


def turn_head(context: SkillContext, pan_rad: float, tilt_rad: float) -> Skill:
    """Turn the head as far towards a direction as its joints allow."""
    limits = context.robot.limits
    targets = {
        name: min(max(angle, limits[name].min), limits[name].max)
        for name, angle in ((PAN, pan_rad), (TILT, tilt_rad))
    }
    yield from move_joints(context, targets)
    yield from settle(context, HEAD_JOINTS)


def gaze_at(context: SkillContext, position_m: Any) -> Skill:
    """Look at a point of the map frame."""
    x_m, y_m, z_m = to_base(context.link.pose, position_m)
    eye_m = next(iter(context.arms.values())).camera_pose(context.link.positions)[:3, 3]
    tilt_rad = math.atan2(eye_m[2] - z_m, math.hypot(x_m, y_m) - math.hypot(*eye_m[:2]))
    yield from turn_head(context, math.atan2(y_m, x_m), tilt_rad)


def remembered(context: SkillContext, query: ObjectQuery) -> Mapping[str, Any] | None:
    """Return the nearest object meant that was seen within MEMORY_S, or None."""
    return _nearest(context, query, round(MEMORY_S * NS_PER_S))


def see(context: SkillContext, query: ObjectQuery) -> Skill:
    """Look at an object until it has been seen afresh; read it with `remembered` afterwards.

    Raises:
        TryAgain: it is not where it was.
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
        raise TryAgain(f"the {query} is no longer where I saw it")


def sweep(context: SkillContext, query: ObjectQuery) -> Skill:
    """Let the eyes sweep until the object is seen or the sweep is over."""
    started_ns = context.link.clock.now_ns()
    for pan_rad, tilt_rad in SWEEP:
        yield from turn_head(context, pan_rad, tilt_rad)
        looked = partial(_looked, context, context.link.clock.now_ns())
        yield from wait_until(context, looked, SWEEP_TIMEOUT_S)
        age_ns = context.link.clock.now_ns() - started_ns
        if _nearest(context, query, age_ns) is not None:
            return


def _looked(context: SkillContext, since_ns: int) -> bool:
    """Tell whether perception has judged enough images taken after a moment to confirm things."""
    return context.link.scene_stamp_ns > since_ns + round(CONFIRMED_S * NS_PER_S)


def _nearest(context: SkillContext, query: ObjectQuery, age_ns: int) -> Mapping[str, Any] | None:
    now_ns = context.link.clock.now_ns()
    meant = [
        candidate
        for candidate in context.link.objects
        if query.matches(candidate) and now_ns - int(candidate["last_seen_ns"]) <= age_ns
    ]
    if not meant:
        return None
    pose = context.link.pose
    here = np.array((pose.x_m, pose.y_m))
    return min(meant, key=lambda one: float(np.linalg.norm(np.array(one["position_m"][:2]) - here)))
