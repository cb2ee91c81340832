"""Hold an action's needs and effects against the world as perception tells it, not as remembered.

Both answer as the symbolic conditions do: "" is met, None is not known, any other text says what is
wrong. What nobody can see is no fault.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from vla_deploy.plans.errors import UnknownObject
from vla_deploy.plans.knowledge import parse_object, world_of
from vla_deploy.plans.plan import Action
from vla_deploy.plans.symbolic.conditions import MET, Answer, Setting
from vla_deploy.plans.symbolic.state import Pose, SymbolicState, state_of
from vla_deploy.plans.symbolic.table import LOGIC
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import TryAgain
from vla_deploy.world import Query
from vla_deploy.world.footprint import gap_m
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.touch import is_denied

# A drive ends within centimetres of its goal; farther away the robot is somewhere else.
ARRIVED_M: Final = 0.6
# A thing that was put into or onto another one lies within its outline, or beside it where that was
# wanted, and may have rolled a bit.
PUT_WITHIN_M: Final = 0.35


class WorldCheck:
    """Look at the world for one robot's actions."""

    def __init__(self, context: SkillContext) -> None:
        self._context = context
        self._world = world_of(context.robot, {})

    def unmet(self, action: Action) -> str:
        """Return which need of an action the world denies, "" where it denies none."""
        setting, state = self._now(action)
        if setting.scene is None:
            return ""
        broken = (
            f"{rule}: {why}"
            for rule, holds in LOGIC[action.skill].needs.items()
            if (why := holds(state, setting))
        )
        return next(broken, "")

    def state(self, action: Action) -> SymbolicState:
        """Return what is known now, to be held against what an action changes."""
        return self._now(action)[1]

    def missing_effect(self, action: Action, before: SymbolicState, done_ns: int) -> Answer:
        """Return what the world shows instead of an action's effect; `done_ns` is when it ended.

        While perception is silent nothing is shown, and nothing waited for.
        """
        look = EFFECTS.get(action.skill)
        if look is None:
            return MET
        setting, now = self._now(action)
        return MET if setting.scene is None else look(now, setting, before, done_ns)

    def _now(self, action: Action) -> tuple[Setting, SymbolicState]:
        scene, here = self._context.link.snapshot(), self._here()
        felt = scene.hands if scene is not None else {}
        holding = {
            hand: None if held is None or is_denied(felt.get(hand), held.kind) else held.kind
            for hand, held in self._context.hands.items()
        }
        world = replace(self._world, holding=holding)
        setting = Setting(parameters=action.parameters, world=world, scene=scene)
        return setting, state_of(world, scene, here)

    def _here(self) -> Pose | None:
        try:
            pose = self._context.link.pose
        except TryAgain:
            return None
        return pose.x_m, pose.y_m, pose.yaw_rad


def is_held(now: SymbolicState, setting: Setting, before: SymbolicState, done_ns: int) -> Answer:
    """Do the fingers feel what was taken, and no other of its kind, as far as the scene knows?"""
    del before, done_ns
    scene, query = setting.scene, _query(setting)
    if scene is None or query is None:
        return None
    meant = {one.thing_id for one in query.among(scene)}
    told = [one for one in now.held if scene.thing(one.key) is not None]
    if any(one.key in meant for one in told):
        return MET
    alike = [one for one in now.held if one.kind == query.kind]
    if any(not meant or one not in told for one in alike):
        return MET
    return f"no hand feels the {query}" + "".join(f", but {one.key}" for one in alike)


def is_put(now: SymbolicState, setting: Setting, before: SymbolicState, done_ns: int) -> Answer:
    """Does what the hand held lie where it should, if it has been seen since?"""
    del now
    destination, scene = setting.subject("destination"), setting.scene
    held = before.holding(str(setting.parameters.get("arm", "")))[:1]
    put = scene.thing(held[0].key) if scene is not None and held else None
    container = destination.thing if destination is not None else None
    if put is None or container is None or put.last_seen_ns < done_ns:
        return None
    if put.rests is not None and put.rests.of == container.thing_id:
        return MET
    if setting.parameters.get("relation") == NEXT_TO:
        free_m = gap_m(put, container)
        return (
            f"the {put} lies {free_m:.2f} m from the {container}" if free_m > PUT_WITHIN_M else MET
        )
    off_m = math.dist(put.xy_m, container.xy_m)
    return f"the {put} lies {off_m:.2f} m from the {container}" if off_m > PUT_WITHIN_M else None


def is_found(now: SymbolicState, setting: Setting, before: SymbolicState, done_ns: int) -> Answer:
    """Does perception know the thing?"""
    del now, before, done_ns
    query = _query(setting)
    if setting.scene is None or query is None:
        return None
    return MET if query.among(setting.scene) else f"perception knows no {query}"


def has_arrived(
    now: SymbolicState, setting: Setting, before: SymbolicState, done_ns: int
) -> Answer:
    """Does the robot stand at its goal?"""
    del before, done_ns
    place = setting.place("place")
    if place is None or place not in setting.world.sites or now.spot is None:
        return None
    pose = setting.world.sites[place].pose
    off_m = math.dist(now.spot, (pose.x_m, pose.y_m))
    return MET if off_m <= ARRIVED_M else f"the robot is {off_m:.1f} m from the {place}"


def _query(setting: Setting) -> Query | None:
    try:
        return parse_object(str(setting.parameters["object"]))
    except UnknownObject:
        return None


Look = Callable[[SymbolicState, Setting, SymbolicState, int], Answer]
EFFECTS: Final[Mapping[str, Look]] = MappingProxyType(
    {"pick_up": is_held, "place": is_put, "find_object": is_found, "navigate_to": has_arrived}
)
