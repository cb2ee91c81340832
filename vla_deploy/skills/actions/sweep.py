"""Drive over all the floor of a place, and tell which share of it the body has been over."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from vla_deploy.navigation.coverage import FloorCoverage
from vla_deploy.navigation.errors import NoPath
from vla_deploy.plans.knowledge import match_place, spoken_places
from vla_deploy.robots.floor_pose import Points, Pose2D
from vla_deploy.skills.context import Skill, SkillContext, spoken
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.drive import base_of, drive_to, follow
from vla_deploy.skills.movements.gaze import DRIVING_GAZE, turn_head

AROUND_M: Final = 2.0
"""Half the side of the square that belongs to a place whose floor no robot file bounds."""
ENOUGH_RATIO: Final = 0.98
MOST_CORNERS: Final = 100
"""After the lanes, single spots: each costs a way."""


def sweep(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Drive over the floor of `place` in lanes, then to what was left; tell the covered share.

    Raises:
        NotPossible: there is no such place, no base, or no free floor there.
        TryAgain: less than half of the floor could be reached.
    """
    base_of(context)
    name = match_place(str(parameters["place"]), spoken_places(context.robot.places))
    if name is None:
        raise NotPossible(f"I do not know the place {parameters['place']!r}")
    try:
        floor = FloorCoverage(context.planner, _corners(context, name))
    except NoPath as error:
        raise NotPossible(f"I cannot sweep the {spoken(name)}: {error}") from error
    yield from carry(context)
    yield from turn_head(context, *DRIVING_GAZE)
    for start, end in floor.lanes(_here(context)):
        yield from _noting(context, floor, _go(context, start))
        yield from _noting(context, floor, _along(context, start, end))
    for _ in range(MOST_CORNERS):
        spot = floor.missed(_here(context))
        if spot is None or floor.covered_ratio > ENOUGH_RATIO:
            break
        yield from _noting(context, floor, _go(context, spot))
        floor.leave_out(float(spot[0]), float(spot[1]))
    _tell(context, floor, name)


def _tell(context: SkillContext, floor: FloorCoverage, name: str) -> None:
    share = floor.covered_ratio
    context.tell(covered_ratio=round(share, 3), area_m2=round(floor.area_m2, 2))
    context.note(f"{share:.0%} of {floor.area_m2:.1f} m² of the {spoken(name)} covered")
    if share < 0.5:
        raise TryAgain(f"I got over {share:.0%} of the floor of the {spoken(name)} only")


def _corners(context: SkillContext, name: str) -> Sequence[tuple[float, float]]:
    place = context.robot.places[name]
    if place.floor_m:
        return place.floor_m
    x_m, y_m = place.pose.x_m, place.pose.y_m
    sides = ((-1, -1), (-1, 1), (1, 1), (1, -1))
    return [(x_m + right * AROUND_M, y_m + up * AROUND_M) for right, up in sides]


def _here(context: SkillContext) -> tuple[float, float]:
    pose = context.link.pose
    return pose.x_m, pose.y_m


def _go(context: SkillContext, to: Points) -> Skill:
    goal = Pose2D(float(to[0]), float(to[1]), 0.0)
    yield from drive_to(context, goal, turn=False)


def _along(context: SkillContext, start: Points, end: Points) -> Skill:
    yield from follow(context, np.vstack((start, end)), None)


def _noting(context: SkillContext, floor: FloorCoverage, drive: Skill) -> Skill:
    """Note where the base gets on a drive; what cannot be reached is left for later."""
    try:
        for _ in drive:
            floor.pass_over(*_here(context))
            yield
    except (NotPossible, TryAgain) as error:
        context.note(f"left out: {error}")
