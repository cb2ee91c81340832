"""Read what older tools say of the surroundings: where things are, the robot, and the bounds."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, TypeGuard

from vla_deploy.plans.dialects import values
from vla_deploy.plans.dialects.findings import Findings, PlanNote, shown
from vla_deploy.plans.dialects.values import NotMeant
from vla_deploy.plans.errors import PlanInvalid, UnknownObject
from vla_deploy.plans.knowledge import World, match_place, parse_object
from vla_deploy.world import Snapshot, Thing, Viewpoint

LOCATIONS: Final = "object_locations"
ROBOT: Final = "robot_position"
BOUNDS: Final = "map_bounds"
_KEYS: Final = (LOCATIONS, ROBOT, BOUNDS)
_INSIDE: Final = "environment_context"


@dataclass(frozen=True, slots=True, kw_only=True)
class ContextReading:
    """Hold the scene of a context document, the world within its bounds, and what is not used."""

    scene: Snapshot
    world: World
    notes: tuple[PlanNote, ...]


def is_context(document: Any) -> TypeGuard[Mapping[str, Any]]:
    """Return whether a document is of this form, or a request that holds one."""
    return isinstance(document, Mapping) and any(key in document for key in (*_KEYS, _INSIDE))


def read_context(document: Mapping[str, Any], world: World) -> ContextReading:
    """Return the scene that a context document describes; sizes are not in it, and not judged.

    Raises:
        PlanInvalid: it is of another form; every fault is named.
    """
    context, findings = document.get(_INSIDE, document), Findings()
    if not isinstance(context, Mapping):
        raise PlanInvalid([f"{_INSIDE} must be an object; got {shown(context)}"])
    for key, value in context.items():
        if key not in _KEYS:
            findings.note("", key, value, "not used")
    things = tuple(_things(context.get(LOCATIONS, {}), world, findings))
    robot = _robot(context.get(ROBOT), findings)
    bounded = _within(world, context.get(BOUNDS), findings)
    if findings.faults:
        raise PlanInvalid(findings.faults)
    scene = Snapshot(stamp_ns=0, things=things, robot=robot)
    return ContextReading(scene=scene, world=bounded, notes=tuple(findings.notes))


def _things(given: Any, world: World, findings: Findings) -> Iterator[Thing]:
    if not isinstance(given, Mapping):
        findings.fault("", f"{LOCATIONS} must be an object of names and points; got {shown(given)}")
        return
    for number, (name, value) in enumerate(given.items(), start=1):
        spot = _point(f"{LOCATIONS}.{name}", value, findings)
        said = values.spoken(name, "a name") if name.strip() else name
        if match_place(said, world.places):
            findings.note("", name, value, "not used, the robot file says where this place is")
            continue
        try:
            asked = parse_object(said)
        except UnknownObject as error:
            findings.note("", name, value, f"not used, {error}")
            continue
        yield Thing(
            thing_id=asked.thing_id or f"{asked.kind}_{number}",
            kind=asked.kind,
            colour=asked.colour,
            position_m=spot,
            size_m=(0.0, 0.0, 0.0),
        )


def _point(key: str, value: Any, findings: Findings) -> tuple[float, float, float]:
    taken = findings.read("", key, value, values.point)
    named = {} if taken is None else taken.parameters[values.POINT]
    return named.get("x_m", 0.0), named.get("y_m", 0.0), named.get("z_m", 0.0)


def _robot(value: Any, findings: Findings) -> Viewpoint | None:
    if value is None:
        return None
    x_m, y_m, _ = _point(ROBOT, value, findings)
    findings.note("", ROBOT, value, "its heading is not told, and taken as 0 rad")
    return Viewpoint(x_m=x_m, y_m=y_m)


def _within(world: World, value: Any, findings: Findings) -> World:
    """Return the world with bounds that are no wider than those of a context document."""
    if value is None:
        return world
    taken = findings.read("", BOUNDS, value, _four_numbers)
    if taken is None:
        return world
    told, own = taken.parameters["bounds"], world.bounds.map_bounds_m
    both = (max(told[0], own[0]), max(told[1], own[1]), min(told[2], own[2]), min(told[3], own[3]))
    return replace(world, bounds=replace(world.bounds, map_bounds_m=both))


def _four_numbers(value: Any) -> values.ValueReading:
    expected = "[min x, min y, max x, max y] in m"
    if not isinstance(value, list) or len(value) != 4:
        raise NotMeant(expected)
    return values.ValueReading({"bounds": [values.number_of(one, expected) for one in value]})
