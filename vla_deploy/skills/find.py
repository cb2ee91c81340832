"""Find an object: in memory, by sweeping the eyes, then from each viewpoint of the home."""

import math
from collections.abc import Mapping
from typing import Any

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
    """Return every viewpoint, nearest first, without the one the robot stands at."""
    pose = context.link.pose
    distances = [
        (math.hypot(viewpoint.x_m - pose.x_m, viewpoint.y_m - pose.y_m), place.name, viewpoint)
        for place in context.robot.places.values()
        for viewpoint in place.viewpoints
    ]
    return [view for distance, _, view in sorted(distances, key=lambda d: d[:2]) if distance > 0.3]


def _nowhere(context: SkillContext, query: ObjectQuery) -> str:
    seen = sorted({f"{one['colour']} {one['class']}" for one in context.link.objects})
    return f"I cannot find a {query}; I have seen: {', '.join(seen) or 'nothing'}"
