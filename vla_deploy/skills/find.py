"""Find an object: in memory, by sweeping the eyes, then from each viewpoint of the home."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from vla_deploy.navigation.errors import NavigationError
from vla_deploy.planning.references import ObjectQuery, parse_object
from vla_deploy.robots.description import FloorPose
from vla_deploy.skills.arms import carry
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.drive import drive_to
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.gaze import remembered, sweep


def find_object(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Look for an object until it is in the scene.

    Raises:
        TryAgain: it is nowhere to be seen.
    """
    query = parse_object(parameters["object"])
    if remembered(context, query) is not None:
        return
    yield from sweep(context, query)
    for viewpoint in _viewpoints(context):
        if remembered(context, query) is not None:
            return
        yield from carry(context)
        try:
            yield from drive_to(context, viewpoint)
        except NotPossible:
            continue  # a viewpoint that cannot be reached now leaves the others to try
        yield from sweep(context, query)
    if remembered(context, query) is None:
        raise TryAgain(_nowhere(context, query))


def _viewpoints(context: SkillContext) -> list[FloorPose]:
    """Return every viewpoint once, the one with the shortest way first."""
    places = context.robot.places.values()
    unique = dict.fromkeys(viewpoint for place in places for viewpoint in place.viewpoints)
    ways = [
        (_way_m(context, viewpoint), number, viewpoint) for number, viewpoint in enumerate(unique)
    ]
    return [
        viewpoint for way_m, _, viewpoint in sorted(ways, key=lambda way: way[:2]) if way_m > 0.3
    ]


def _way_m(context: SkillContext, goal: FloorPose) -> float:
    pose = context.link.pose
    try:
        points = context.planner.plan((pose.x_m, pose.y_m), (goal.x_m, goal.y_m))
    except NavigationError:
        return math.inf
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _nowhere(context: SkillContext, query: ObjectQuery) -> str:
    seen = sorted({f"{one['colour']} {one['class']}" for one in context.link.objects})
    return f"I cannot find a {query}; I have seen: {', '.join(seen) or 'nothing'}"
