"""Judge, one by one, what must hold before an action; each answers met, unknown, or why not.

What nobody knows is no fault: perception and the skills judge it when the time has come.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.manipulation.errors import TooWide
from vla_deploy.manipulation.grasps import (
    SIZE_DOUBT_M,
    GraspKind,
    grasps_from_above,
    side_grip_m,
    side_refusal,
)
from vla_deploy.plans.knowledge import World, match_place
from vla_deploy.plans.symbolic.state import Point, Subject, SymbolicState, subject_or_none
from vla_deploy.robots.description import KeepOutZone
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.world import Snapshot
from vla_deploy.world.access import IsFree, stands_around
from vla_deploy.world.footprint import polygon_depth_m
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN
from vla_deploy.world.thing import FLOOR, Rest
from vla_deploy.world.vocabulary import CONTAINERS

# Farther than that from where it stands, the robot is surely not before a thing.
SURELY_AWAY_M: Final = 1.6
# Less than that and the robot still stands where it stood.
SMALL_MOVE_M: Final = 0.1
# How far apart the points are at which a straight way is judged.
STEP_M: Final = 0.1

MET: Final = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Hold what an action is judged against, besides the state."""

    parameters: Mapping[str, Any]
    world: World
    scene: Snapshot | None = None

    def subject(self, name: str) -> Subject | None:
        """Return the thing that a parameter names; None where it is a place, or not given."""
        return subject_or_none(self.parameters.get(name), self.scene)

    def place(self, name: str) -> str | None:
        """Return the place that a parameter names, or None."""
        value = self.parameters.get(name)
        return match_place(value, self.world.places) if isinstance(value, str) else None


# MET is no fault, None is not known, any other text says what is wrong.
Answer = str | None
Condition = Callable[[SymbolicState, Setting], Answer]


def is_known(state: SymbolicState, setting: Setting) -> Answer:
    """Has the thing been looked for, or seen?"""
    subject = setting.subject("object") or setting.subject("destination")
    if subject is None or subject.key in state.found or state.holds(subject.key):
        return MET
    if setting.scene is None or subject.thing is not None or subject.others:
        return None
    return f"the {subject.words} has not been seen; find_object comes first"


def is_before(state: SymbolicState, setting: Setting) -> Answer:
    """Does the robot stand where the thing, or the place, is within reach?"""
    place, sites = setting.place("destination"), setting.world.sites
    subject = setting.subject("object") or setting.subject("destination")
    at = place or (subject.key if subject is not None else "")
    what = at if place is not None or subject is None else subject.words
    if not at or state.at == at:
        return MET
    if "navigate_to" not in setting.world.skills:
        return _within_reach(state, setting, subject)
    spot = None
    if place is not None:
        spot = (sites[place].pose.x_m, sites[place].pose.y_m) if place in sites else None
    elif subject is not None and subject.thing is not None:
        spot = subject.thing.xy_m
    elif state.at in sites:
        return f"the robot went to {state.at}; navigate_to it first"
    if spot is None or state.spot is None:
        return None
    distance_m = math.dist(state.spot, spot)
    if distance_m <= SURELY_AWAY_M:
        return None
    return f"the {what} is {distance_m:.1f} m away; navigate_to it first"


def _within_reach(state: SymbolicState, setting: Setting, subject: Subject | None) -> Answer:
    """Is a thing within reach of a robot that cannot drive there?"""
    thing, reach = None if subject is None else subject.thing, setting.world.reach
    if subject is None or thing is None or reach is None or state.pose is None:
        return MET
    if reach.has(Pose2D(*state.pose).local(thing.position_m)):
        return MET
    return f"the {subject.words} is out of reach, and the robot cannot drive"


def has_free_hand(state: SymbolicState, setting: Setting) -> Answer:
    """Is the hand that shall take free, or any?"""
    arm = str(setting.parameters.get("arm", ""))
    if not state.hands:
        return None
    in_arm = [one for one in state.held if one.hand == arm and arm]
    if in_arm:
        return f"the {arm} hand holds the {in_arm[0].key}"
    if state.free_hands() > 0:
        return MET
    return f"no hand is free ({', '.join(map(str, state.held))}); place something first"


def holds_something(state: SymbolicState, setting: Setting) -> Answer:
    """Does the hand that shall put down hold something?"""
    arm = str(setting.parameters.get("arm", ""))
    if state.holding(arm):
        return MET
    if not state.hands or (arm and arm not in state.hands):
        return None
    return f"the {arm} hand holds nothing" if arm else "no hand holds anything"


def knows_which(state: SymbolicState, setting: Setting) -> Answer:
    """With both hands full, is it said which one puts down?"""
    if len(state.held) < 2 or "arm" in setting.parameters:
        return MET
    return f"{len(state.held)} hands hold something ({', '.join(map(str, state.held))}); say which"


def is_not_held(state: SymbolicState, setting: Setting) -> Answer:
    """Is what shall be used not in a hand itself?"""
    subject = setting.subject("object") or setting.subject("destination")
    if subject is None or not state.holds(subject.key):
        return MET
    return f"a hand holds the {subject.words} itself"


def can_be_gripped(_: SymbolicState, setting: Setting) -> Answer:
    """Is the thing narrow enough, and at a height, for a hand from above or from the side?"""
    subject, opening_m = setting.subject("object"), setting.world.opening_max_m
    if subject is None or subject.thing is None or opening_m is None:
        return None
    thing = subject.thing
    try:
        grasps = grasps_from_above(
            thing.kind, thing.position_m, thing.size_m, thing.yaw_rad, opening_m, SIZE_DOUBT_M
        )
    except TooWide as error:
        return str(error)
    wanted, reach = setting.parameters.get("grasp"), setting.world.reach
    not_so = not_from_side(setting.world) or side_refusal(thing.kind, thing.size_m, SIZE_DOUBT_M)
    if wanted == GraspKind.SIDE and not_so:
        return not_so
    if reach is None:
        return None
    from_above_m = () if wanted == GraspKind.SIDE else (grasps[0].point_m[2],)
    beside_m = thing.bottom_m + side_grip_m(thing.size_m)
    from_side_m = () if wanted == GraspKind.TOP or not_so else (beside_m,)
    refusals = [reach.height_refusal(height_m) for height_m in (*from_above_m, *from_side_m)]
    return MET if "" in refusals else refusals[0]


def not_from_side(world: World) -> str:
    """Return why the robot grasps nothing from the side, "" where it does."""
    return (
        "" if world.takes_from_side else "from the side takes an arm of six joints; mine has less"
    )


def is_light_enough(_: SymbolicState, setting: Setting) -> Answer:
    """Is the thing within what one hand may carry?"""
    subject, limit_kg = setting.subject("object"), setting.world.bounds.payload_kg
    mass_kg = None if subject is None else subject.mass_kg
    if mass_kg is None or mass_kg <= limit_kg:
        return None if mass_kg is None else MET
    return f"it may weigh {mass_kg:.2f} kg by its size, a hand carries {limit_kg:g} kg"


def takes_things(state: SymbolicState, setting: Setting) -> Answer:
    """Can something be put in, on or next to the destination?"""
    place, subject = setting.place("destination"), setting.subject("destination")
    relation = setting.parameters.get("relation")
    if relation == NEXT_TO:
        return _has_room_beside(state, subject)
    if place is not None:
        if relation == IN:
            return f"nothing is put in the {place}, only on it"
        bare = setting.world.furniture and place not in setting.world.furniture
        return f"there is nothing at the {place} to put things on" if bare else MET
    if relation == IN and subject is not None and subject.kind not in CONTAINERS:
        return f"a {subject.kind} is no container; things go into: {', '.join(sorted(CONTAINERS))}"
    return MET


def rest_of_subject(state: SymbolicState, subject: Subject) -> Rest | None:
    """Return what a thing rests in or on: where the plan has put it, else where it was seen."""
    return state.rests.get(subject.key) or (subject.thing.rests if subject.thing else None)


def _has_room_beside(state: SymbolicState, subject: Subject | None) -> Answer:
    if subject is None:
        return "things are put next to things, and on furniture"
    rest = rest_of_subject(state, subject)
    if rest is None:
        return None
    if rest.relation == IN:
        return f"the {subject.words} is in the {rest.of}: put it in there as well"
    return "nothing is put down on the floor" if rest.of == FLOOR else MET


def opens_empty(state: SymbolicState, setting: Setting) -> Answer:
    """Would opening the hand drop nothing?"""
    held = state.holding(str(setting.parameters.get("arm", "")))
    if not held:
        return MET
    return f"it would drop what is held ({held[0]}); place it, or hand it over instead"


def may_go_there(state: SymbolicState, setting: Setting) -> Answer:
    """Is the goal outside the zones, and on free floor where a map is at hand?"""
    world = setting.world
    place, subject = setting.place("place"), setting.subject("object")
    if subject is not None and subject.thing is not None:
        what, thing = f"the {subject.words}", subject.thing
        return _outside(thing.xy_m, what, world) or _refusal(
            _zone_around(thing.position_m, world), what
        )
    if place is not None and place in world.sites:
        pose = world.sites[place].pose
        spot = (pose.x_m, pose.y_m)
        return _outside(spot, f"the {place}", world) or _refusal(
            _zone_at(spot, world), f"the {place}"
        )
    if "x_m" in setting.parameters and "y_m" in setting.parameters:
        return _may_stand(float(setting.parameters["x_m"]), float(setting.parameters["y_m"]), world)
    return None


def _may_stand(x_m: float, y_m: float, world: World) -> Answer:
    what = f"the point {x_m:g}, {y_m:g} m"
    refusal = _outside((x_m, y_m), what, world) or _refusal(_zone_at((x_m, y_m), world), what)
    if refusal:
        return refusal
    if world.is_free is not None and not world.is_free(x_m, y_m):
        return f"the map shows no free floor at {x_m:g}, {y_m:g} m"
    return MET


def way_is_allowed(state: SymbolicState, setting: Setting) -> Answer:
    """Does the straight way keep out of the zones, and on free floor where a map is at hand?"""
    if state.pose is None:
        return None
    x_m, y_m, yaw_rad = state.pose
    way_m = float(setting.parameters["distance_m"])
    end = (x_m + way_m * math.cos(yaw_rad), y_m + way_m * math.sin(yaw_rad))
    what = f"the way of {way_m:g} m"
    refusal = _outside(end, what, setting.world) or _refusal(
        _zone_on_way((x_m, y_m), end, setting.world), what
    )
    if refusal or setting.world.is_free is None or abs(way_m) < SMALL_MOVE_M:
        return refusal
    free_m = _blocked_on_way((x_m, y_m), end, setting.world.is_free)
    return MET if free_m is None else f"{way_m:g} m asked, the map shows {free_m:.1f} m of room"


def _outside(spot: Point, what: str, world: World) -> Answer:
    if world.bounds.holds(*spot):
        return MET
    low_x, low_y, high_x, high_y = world.bounds.map_bounds_m
    return (
        f"{what} is outside of x {low_x:g} to {high_x:g} m, y {low_y:g} to {high_y:g} m, the "
        "map_bounds_m in force"
    )


def _refusal(zone: KeepOutZone | None, what: str) -> Answer:
    return MET if zone is None else f"{what} is in the {zone.name}: {zone.reason}"


def is_slow_enough(_: SymbolicState, setting: Setting) -> Answer:
    """Is the speed within what the base may do?"""
    speed_m_s, most_m_s = setting.parameters.get("speed_m_s"), setting.world.max_speed_m_s
    if speed_m_s is None or most_m_s is None:
        return MET
    too_fast = float(speed_m_s) > most_m_s
    return f"{speed_m_s:g} m/s asked, {most_m_s:g} m/s at most" if too_fast else MET


# --- zones, and what the map shows --------------------------------------------------------------


def _zone_at(point_m: Point, world: World) -> KeepOutZone | None:
    """Return the zone that the base would enter at a point, or None."""
    return next(
        (zone for zone in world.zones
         if polygon_depth_m(point_m, zone.polygon_m) > -world.footprint_radius_m), None
    )  # fmt: skip


def _zone_on_way(start: Point, end: Point, world: World) -> KeepOutZone | None:
    """Return the first zone that a straight way newly enters, or None."""
    if not world.zones or _zone_at(start, world) is not None:
        return None
    found = (_zone_at(point, world) for point in _points(start, end))
    return next((zone for zone in found if zone is not None), None)


def _zone_around(position_m: tuple[float, float, float], world: World) -> KeepOutZone | None:
    """Return the zone that a thing lies in, or in which one would stand to reach it, or None."""
    lies_in = (one for one in world.zones if polygon_depth_m(position_m, one.polygon_m) > 0.0)
    inside = next(lies_in, None)
    if inside is not None:
        return inside
    near = _zone_at(position_m[:2], world)
    if near is None:
        return None
    stands = stands_around(
        position_m, lambda x_m, y_m: _zone_at((x_m, y_m), world) is None, world.reach
    )
    return near if next(stands, None) is None else None


def _blocked_on_way(start: Point, end: Point, is_free: IsFree) -> float | None:
    """Return how far a straight way leads over free floor, None where all of it is free.

    Furniture that the robot stands at may be nearer than the map allows; away from it is free.
    """
    was_free = is_free(*start)
    for point in _points(start, end):
        now_free = is_free(*point)
        if not now_free and (was_free or point == end):
            return math.dist(start, point)
        was_free = was_free or now_free
    return None


def _points(start: Point, end: Point) -> Iterator[Point]:
    count = max(1, math.ceil(math.dist(start, end) / STEP_M))
    for step in range(1, count + 1):
        share = step / count
        yield (
            end
            if step == count
            else (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
        )
