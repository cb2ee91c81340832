"""Go to a place, a point, or to where an object can be reached."""

import math
from collections.abc import Callable, Generator, Mapping
from typing import Any, Final, TypeVar

from vla_deploy.plans.knowledge import match_place, parse_object, spoken_places
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.context import Skill, SkillContext, spoken
from vla_deploy.skills.errors import NotPossible, OutOfReach, TryAgain
from vla_deploy.skills.movements.carrying import carry
from vla_deploy.skills.movements.drive import drive_to, tell_place, turn_by
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.gaze import DRIVING_GAZE, remembered, see, turn_head
from vla_deploy.skills.movements.stand import standing_poses
from vla_deploy.world import Query

# Where the heading goes, left of a thing that a hand before one shoulder may hide.
PAST_HAND_RAD: Final = {("left",): 0.15, ("right",): -0.15, ("left", "right"): 0.0}

_NO_WAY: Final = "and without a lidar I do not find my way to it; drive me nearer"

T = TypeVar("T")
Solving = Generator[None, None, T]


def navigate_to(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Drive to `place`, to `x_m`, `y_m` (and `yaw_rad`), or to where `object` can be reached.

    Raises:
        NotPossible: the place is unknown or no path leads there.
        TryAgain: the object has not been seen, or the way is blocked.
    """
    yield from _go(context, parameters)
    tell_place(context)


def _go(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    yield from carry(context)
    speed_m_s = parameters.get("speed_m_s")
    if "object" in parameters:
        yield from reach(context, parse_object(parameters["object"]), speed_m_s=speed_m_s)
        return
    yield from turn_head(context, *DRIVING_GAZE)
    if "place" in parameters:
        yield from drive_to(
            context, pose_of_place(context, parameters["place"]), speed_m_s=speed_m_s
        )
        return
    yaw_rad = parameters.get("yaw_rad")
    goal = Pose2D(
        x_m=float(parameters["x_m"]),
        y_m=float(parameters["y_m"]),
        yaw_rad=float(yaw_rad) if yaw_rad is not None else 0.0,
    )
    yield from drive_to(context, goal, turn=yaw_rad is not None, speed_m_s=speed_m_s)


def reach(
    context: SkillContext,
    query: Query,
    anew: bool = False,
    speed_m_s: float | None = None,
) -> Skill:
    """Drive to the best standing pose from which an object is within the arms' reach.

    `anew` leaves a pose that would do: it has just proved not to.

    Raises:
        TryAgain: the object has not been seen.
        NotPossible: no pose near it is free and reachable, or it is where the plan keeps out of.
    """
    known = remembered(context, query)
    if known is None:
        raise TryAgain(f"I have not seen a {query}; look for it first")
    refuse_kept_out(context, query, known["id"])
    if not context.robot.finds_its_way:
        if anew or not context.robot.reach.has(to_base(context.link.pose, known["position_m"])):
            why = "and I cannot drive" if context.robot.parts.base is None else _NO_WAY
            raise OutOfReach(f"the {query} is out of my reach, {why}")
        return
    reasons = []
    for goal in standing_poses(context, known["position_m"], anew=anew):
        try:
            yield from drive_to(context, goal, speed_m_s=speed_m_s)
        except NotPossible as error:
            reasons.append(str(error))
            continue
        return
    why = reasons[0] if reasons else "walls or furniture stand around it"
    context.out_of_reach[known["id"]] = context.link.clock.now_ns()
    raise NotPossible(f"I cannot get within reach of the {query}: {why}")


def refuse_kept_out(context: SkillContext, query: Query, thing_id: str) -> None:
    """Refuse to go to a thing that lies where the plan keeps out of.

    Raises:
        NotPossible: it does.
    """
    scene = context.link.snapshot() if context.keeps_out else None
    for place in () if scene is None else scene.below(thing_id):
        if place in context.keeps_out:
            raise NotPossible(f"the {query} is at the {spoken(place)}, where I was told not to go")


def solve_near(context: SkillContext, query: Query, solve: Callable[[], T]) -> Solving[T]:
    """See an object and solve for it; where it is out of reach, stand elsewhere and try again.

    Raises:
        TryAgain: the object is not where it was.
        OutOfReach: it is, from both poses.
    """
    yield from _see_past_hands(context, query)
    try:
        return solve()
    except OutOfReach:
        yield from reach(context, query, anew=True)
    yield from _see_past_hands(context, query)
    return solve()


def _see_past_hands(context: SkillContext, query: Query) -> Skill:
    """See an object; where a full hand may hide it, turn that hand out of the way and look again.

    Raises:
        TryAgain: the object is not where it was.
    """
    try:
        yield from see(context, query)
    except TryAgain:
        known, full = remembered(context, query), _full_hands(context)
        if known is None or not full or not context.robot.finds_its_way:
            raise
        x_m, y_m, _ = to_base(context.link.pose, known["position_m"])
        yield from turn_by(context, math.atan2(y_m, x_m) + PAST_HAND_RAD[full])
        yield from see(context, query)


def _full_hands(context: SkillContext) -> tuple[str, ...]:
    return tuple(sorted(hand for hand, held in context.hands.items() if held is not None))


def pose_of_place(context: SkillContext, name: str) -> Pose2D:
    """Return where one stands for a place.

    Raises:
        NotPossible: there is no such place.
    """
    place = match_place(name, spoken_places(context.robot.places))
    if place is None:
        known = ", ".join(sorted(context.robot.places))
        raise NotPossible(f'I do not know the place "{name}"; I know: {known}')
    return context.robot.places[place].pose
