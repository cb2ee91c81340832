"""Judge by measurement whether actions can be carried out from how the world is now.

Step by step: what it needs, what is in its way, what it leaves. `JUDGES` has a row for each skill
that the world can refuse; the others always can be done.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.outlook import CannotBe, Outlook
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.manipulation.grasps import grasps_from_above
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES
from vla_deploy.plans.knowledge import match_place
from vla_deploy.plans.plan import Action
from vla_deploy.world import Query, Thing, UnknownWord, access_to, parse_query
from vla_deploy.world.access import Bar, GraspAccess, Obstacle, stands_around
from vla_deploy.world.memory import still_there
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.vocabulary import CONTAINERS

Parameters = Mapping[str, Any]
Judge = Callable[[Parameters, Outlook], None]

WALL_M: Final = 0.008
STEP_M: Final = 0.05
MOST_STANDS: Final = 6
# What is in the way of a grasp and can be cleared, and how; the rest ends the matter.
REMEDIES: Final[Mapping[Bar, str]] = {
    Bar.ON_TOP: "take the {by} off the {thing}",
    Bar.BESIDE: "move the {by} away from the {thing}",
    Bar.UNSURE: "look at the {thing} again: {why}",
}
_SETTLED: Final = frozenset({Bar.HELD, Bar.HANDS_FULL})


def judge_action(action: Action, question: SceneQuestion, abilities: Abilities) -> Task:
    """Return the verdict on one action of a plan."""
    return judge_actions((action,), Outlook.of(question, abilities))


def judge_actions(actions: Sequence[Action], outlook: Outlook) -> Task:
    """Return the verdict on actions that follow each other."""
    try:
        for action in actions:
            judge = JUDGES.get(action.skill)
            if judge is not None:
                judge(action.parameters, outlook)
    except CannotBe as found:
        return outlook.verdict(Feasible.NO, found.belief, str(found))
    if outlook.unseen:
        unseen = " and ".join(f"the {one}" for one in outlook.unseen)
        reason = f"{unseen} must be found first; what comes after cannot be judged"
        return outlook.verdict(Feasible.UNKNOWN, 0.0, reason)
    if outlook.prerequisites:
        reason = "something must be done before"
        return outlook.verdict(Feasible.AFTER_PREREQUISITES, outlook.belief, reason)
    reason = f"{len(actions)} steps, and nothing in their way"
    return outlook.verdict(Feasible.YES, outlook.belief, reason)


def _look(parameters: Parameters, outlook: Outlook) -> None:
    if "object" in parameters:
        outlook.meant(_query(parameters["object"]))


def _navigate(parameters: Parameters, outlook: Outlook) -> None:
    if "object" in parameters:
        thing = outlook.meant(_query(parameters["object"]))
        if thing is not None and not thing.held_by:
            _approach(thing, outlook)
    elif "place" in parameters:
        place = match_place(str(parameters["place"]), outlook.abilities.spoken)
        if place is None:
            known = ", ".join(sorted(outlook.abilities.places))
            raise CannotBe(f'no place "{parameters["place"]}" is known; known: {known}')
        pose = outlook.abilities.places[place].pose
        outlook.drive((pose.x_m, pose.y_m), f"the {place.replace('_', ' ')}")
    else:
        x_m, y_m = float(parameters["x_m"]), float(parameters["y_m"])
        outlook.drive((x_m, y_m), f"{x_m:.1f}, {y_m:.1f} m")


def _approach(thing: Thing, outlook: Outlook) -> None:
    """Drive to the nearest free stand before a thing to which a way leads."""
    here = outlook.at or thing.xy_m
    abilities = outlook.abilities
    stands = stands_around(thing.position_m, abilities.planner.is_free, abilities.body.reach)
    nearest = sorted(stands, key=lambda one: math.dist((one.x_m, one.y_m), here))[:MOST_STANDS]
    refusal = CannotBe(
        f"walls or furniture leave no place to stand before the {thing}", thing.confidence
    )
    for stand in nearest:
        try:
            outlook.drive((stand.x_m, stand.y_m), f"the {thing}")
        except CannotBe as error:
            refusal = error
            continue
        return
    raise refusal


def _move(parameters: Parameters, outlook: Outlook) -> None:
    robot = outlook.question.world.robot
    if robot is None or outlook.at is None:
        outlook.need("find out where the robot is")
        return
    distance_m = float(parameters["distance_m"])
    cosine, sine = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
    for step in range(1, math.ceil(abs(distance_m) / STEP_M) + 1):
        gone_m = math.copysign(min(step * STEP_M, abs(distance_m)), distance_m)
        x_m, y_m = outlook.at[0] + gone_m * cosine, outlook.at[1] + gone_m * sine
        if not outlook.abilities.planner.is_free(x_m, y_m):
            free_m = max(0.0, (step - 1) * STEP_M)
            outlook.alternatives.append(f"move {free_m:.1f} m at most")
            raise CannotBe(f"after {free_m:.1f} m something stands in the way")
    outlook.at = (x_m, y_m) if distance_m else outlook.at


def _pick_up(parameters: Parameters, outlook: Outlook) -> None:
    query = _query(parameters["object"])
    thing = outlook.meant(query)
    kind = query.kind if thing is None else thing.kind
    if kind not in GRASPABLE_CLASSES:
        raise CannotBe(f"a {kind} is too large to grasp")
    hand = _free_hand(parameters, outlook, kind)
    if hand is None:
        return
    if thing is not None and not thing.held_by:
        _take(thing, hand, outlook)
    outlook.holding[hand], outlook.held = kind, thing


def _free_hand(parameters: Parameters, outlook: Outlook, kind: str) -> str | None:
    """Return the hand to take with, one that must be emptied where none is free."""
    if kind in outlook.holding.values():
        return None  # it is held already
    hands = [parameters["arm"]] if "arm" in parameters else list(outlook.abilities.body.hands)
    free = [name for name in hands if outlook.holding.get(name) is None]
    if free:
        return str(free[0])
    if not hands:
        raise CannotBe("the robot has no hand")
    outlook.need(f"put down the {outlook.holding[hands[0]]} in the {hands[0]} hand")
    return str(hands[0])


def _take(thing: Thing, hand: str, outlook: Outlook) -> None:
    world, abilities = outlook.question.world, outlook.abilities
    access = access_to(thing, world, abilities.body)
    belief = still_there(thing, world.unseen_s(thing))
    for obstacle in access.obstacles:
        if obstacle.bar in _SETTLED:
            continue
        _clear(obstacle, thing, access, outlook, belief)
    height_m = _grip_height_m(thing, outlook)
    if not abilities.arms.reach_height(hand, height_m):
        outlook.alternatives += outlook.others_like(thing)
        raise CannotBe(
            f"the {hand} hand does not get to a grip of the {thing}, {height_m:.2f} m high",
            belief,
        )


def _clear(
    obstacle: Obstacle, thing: Thing, access: GraspAccess, outlook: Outlook, belief: float
) -> None:
    remedy = REMEDIES.get(obstacle.bar)
    outlook.obstacles.append(obstacle.why)
    if remedy is None:
        outlook.alternatives += outlook.others_like(thing)
        raise CannotBe(f"the {thing} cannot be taken: {obstacle.why}", belief)
    by = outlook.question.world.thing(obstacle.by)
    outlook.need(remedy.format(by=by or obstacle.by, thing=thing, why=obstacle.why))


def _grip_height_m(thing: Thing, outlook: Outlook) -> float:
    opening_m = outlook.abilities.body.opening_max_m
    grasps = grasps_from_above(thing.kind, thing.position_m, thing.size_m, thing.yaw_rad, opening_m)
    return grasps[0].point_m[2]


def _place(parameters: Parameters, outlook: Outlook) -> None:
    hand = _holding_hand(parameters, outlook)
    destination, relation = str(parameters["destination"]), str(parameters["relation"])
    if match_place(destination, outlook.abilities.spoken) is not None:
        outlook.need("see a free spot there to put it down")
    else:
        thing = outlook.meant(_query(destination))
        if thing is not None:
            _put(hand, thing, relation, outlook)
    outlook.holding[hand], outlook.held = None, None


def _holding_hand(parameters: Parameters, outlook: Outlook) -> str:
    wanted = parameters.get("arm")
    for name, what in outlook.holding.items():
        if what is not None and wanted in (None, name):
            return name
    raise CannotBe("no hand holds anything to put down")


def _put(hand: str, target: Thing, relation: str, outlook: Outlook) -> None:
    world, held = outlook.question.world, outlook.held
    belief = still_there(target, world.unseen_s(target))
    if held is not None and held.thing_id == target.thing_id:
        raise CannotBe(f"the {target} cannot be put {relation} itself")
    if relation == IN:
        if target.kind not in CONTAINERS:
            outlook.alternatives += _containers(outlook)
            raise CannotBe(f"a {target.kind} is no container", belief)
        _fit(held, target, belief)
    elif relation == NEXT_TO:
        outlook.need(f"see a free spot next to the {target}")
    else:
        for other in world.things:
            if other.rests is not None and (other.rests.relation, other.rests.of) == (
                ON, target.thing_id,
            ):  # fmt: skip
                outlook.need(f"take the {other} off the {target}")
    if not outlook.abilities.arms.reach_height(hand, target.top_m + _below_grip_m(held)):
        raise CannotBe(f"the {hand} hand does not reach above the {target}", belief)


def _fit(held: Thing | None, container: Thing, belief: float) -> None:
    room_m = min(container.size_m[:2]) - 2 * WALL_M
    if held is not None and min(held.size_m[:2]) > room_m:
        raise CannotBe(
            f"the {held} is {1000 * min(held.size_m[:2]):.0f} mm wide, the {container} "
            f"{1000 * room_m:.0f} mm inside",
            belief,
        )


def _below_grip_m(held: Thing | None) -> float:
    return 0.0 if held is None else 0.5 * held.size_m[2]


def _containers(outlook: Outlook) -> list[str]:
    return [
        f"put it in the {one} ({one.thing_id})"
        for one in outlook.question.world.things
        if one.kind in CONTAINERS
    ]


def _query(text: Any) -> Query:
    try:
        return parse_query(str(text))
    except UnknownWord as error:
        raise CannotBe(str(error)) from error


JUDGES: Final[Mapping[str, Judge]] = {
    "find_object": _look,
    "look_at": _look,
    "navigate_to": _navigate,
    "inspect": _navigate,
    "guard": lambda given, outlook: _navigate(given, outlook) if "place" in given else None,
    "charge": _navigate,
    "move": _move,
    "pick_up": _pick_up,
    "place": _place,
}
