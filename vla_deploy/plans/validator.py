"""Decide whether a plan may run: schema, skills, parameters, dependencies, world."""

import math
from typing import Any

from vla_deploy.manipulation.grasps import GraspKind, shape_refusal
from vla_deploy.plans.catalogue import GRASPABLE_CLASSES, SKILLS, SkillParameter, SkillSpec, Type
from vla_deploy.plans.errors import PlanError, PlanInvalid, UnknownObject
from vla_deploy.plans.knowledge import World, match_device, match_place, parse_object
from vla_deploy.plans.plan import Action, Plan, dependency_faults
from vla_deploy.plans.symbolic.conditions import not_from_side
from vla_deploy.plans.symbolic.simulation import (
    bounds_faults,
    symbolic_faults,
)
from vla_deploy.plans.symbolic.state import Pose
from vla_deploy.world import Snapshot


def check_plan(
    plan: Plan, world: World, scene: Snapshot | None = None, here: Pose | None = None
) -> None:
    """Accept a plan or name everything that is wrong with it.

    `here` is the robot's x, y (m) and yaw (rad) in the map. What is not known is not judged.

    Raises:
        PlanInvalid: carries all faults.
    """
    faults, order = _form_faults(plan, world), dependency_faults(plan.actions)
    if not faults and not order:
        # A plan whose actions are all right one by one is gone through symbol by symbol.
        faults = bounds_faults(plan.actions, world)
        faults += symbolic_faults(plan.actions, world, scene, here)
    if faults or order:
        raise PlanInvalid(faults, order)


def refusal_document(error: PlanError) -> dict[str, list[str]]:
    """Return why a plan was refused, for JSON: faults of its actions, and of their order."""
    order = error.dependency_faults if isinstance(error, PlanInvalid) else ()
    faults = error.faults if isinstance(error, PlanInvalid) else (str(error),)
    return {
        "validation_errors": [one for one in faults if one not in order],
        "dependency_errors": list(order),
    }


def _form_faults(plan: Plan, world: World) -> list[str]:
    """Return what is wrong with a plan whatever the robot sees, holds and knows."""
    faults: list[str] = []
    if not plan.feasible:
        why = plan.reasoning or plan.summary
        faults.append(f"its author says that it is not feasible: {why}")
    elif not plan.actions:
        faults.append("it has no actions")
    for action in plan.actions:
        faults += [f'action "{action.id}": {fault}' for fault in action_faults(action, world)]
    return faults


def action_faults(action: Action, world: World) -> list[str]:
    """Return what is wrong with one action by itself: skill, parameters, types, ranges, names."""
    spec = SKILLS.get(action.skill)
    if spec is None:
        return [f'unknown skill "{action.skill}"; known: {", ".join(SKILLS)}']
    if action.skill in world.lacks:
        return [world.lacks[action.skill]]
    taken = ", ".join(spec.parameters) or "none"
    faults = [
        f'{action.skill} has no parameter "{name}"; it takes: {taken}'
        for name in action.parameters
        if name not in spec.parameters
    ]
    faults += [
        f'{action.skill} needs "{name}", {parameter.type.value}'
        for name, parameter in spec.parameters.items()
        if parameter.required and name not in action.parameters
    ]
    for name, value in action.parameters.items():
        if name in spec.parameters:
            faults += _value_faults(name, value, spec.parameters[name], world)
    return faults + _choice_of_group_faults(action, spec) + _sense_faults(action, world)


def _choice_of_group_faults(action: Action, spec: SkillSpec) -> list[str]:
    if not spec.one_of:
        return []
    given = [group for group in spec.one_of if any(name in action.parameters for name in group)]
    wanted = " or ".join("+".join(group) for group in spec.one_of)
    if len(given) != 1:
        return [f"{action.skill} needs exactly one of {wanted}"]
    missing = [name for name in given[0] if name not in action.parameters]
    return [f'{action.skill} needs "{name}" too' for name in missing]


def _sense_faults(action: Action, world: World) -> list[str]:
    if action.skill == "move_arm" and action.parameters.get("pose") not in world.poses:
        return [f"unknown pose; known: {', '.join(sorted(world.poses))}"]
    if action.skill == "pick_up" and not _object_faults(action.parameters.get("object")):
        kind = parse_object(str(action.parameters["object"])).kind
        if kind not in GRASPABLE_CLASSES:
            return [f"a {kind} is too large to grasp; graspable: {', '.join(GRASPABLE_CLASSES)}"]
        if action.parameters.get("grasp") == GraspKind.SIDE:
            why = not_from_side(world) or shape_refusal(kind)
            return [f"grasp side: {why}"] if why else []
    return []


def _value_faults(name: str, value: Any, parameter: SkillParameter, world: World) -> list[str]:
    match parameter.type:
        case Type.NUMBER:
            return _number_faults(name, value, parameter)
        case Type.TEXT:
            ok = isinstance(value, str) and bool(value.strip()) and len(value) <= 500
            return (
                [] if ok else [f"{name} must be a text of 1 to 500 characters, got {value!r:.40}"]
            )
        case Type.CHOICE:
            ok = value in parameter.choices
            return [] if ok else [f"{name} must be one of {', '.join(parameter.choices)}"]
        case Type.FLAG:
            return [] if isinstance(value, bool) else [f"{name} must be true or false"]
        case Type.PLACE:
            return _place_faults(name, value, world)
        case Type.OBJECT:
            return _object_faults(value)
        case Type.DESTINATION:
            return [] if not _place_faults(name, value, world) else _object_faults(value)
        case Type.DEVICE:
            return _device_faults(name, value, world)


def _number_faults(name: str, value: Any, parameter: SkillParameter) -> list[str]:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return [f"{name} must be a number, got {value!r:.40}"]
    if not parameter.minimum <= value <= parameter.maximum:
        return [f"{name} must lie in {parameter.minimum:g} to {parameter.maximum:g}, got {value:g}"]
    return []


def _place_faults(name: str, value: Any, world: World) -> list[str]:
    if isinstance(value, str) and match_place(value, world.places):
        return []
    known = ", ".join(sorted(set(world.places.values())))
    return [f'{name}: unknown place "{value}"; known: {known}']


def _device_faults(name: str, value: Any, world: World) -> list[str]:
    if match_device(value, world.devices):
        return []
    known = ", ".join(sorted(set(world.devices.values()))) or "none, there is no [[devices]]"
    return [f'{name}: unknown device "{value!s:.60}"; known: {known}']


def _object_faults(value: Any) -> list[str]:
    try:
        parse_object(str(value))
    except UnknownObject as error:
        return [str(error)]
    return []
