"""Say what could be done instead of what the world refuses: take another thing, put it elsewhere.

A replacement keeps the rules that were broken, and nothing is in the way of taking it.
"""

from collections.abc import Iterator
from typing import Final

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.symbolic.conditions import Setting
from vla_deploy.planning.symbolic.simulation import first_broken
from vla_deploy.planning.symbolic.state import Pose
from vla_deploy.planning.symbolic.table import GRASPABLE, LOGIC, PAYLOAD, TAKES_THINGS
from vla_deploy.world import Body, Snapshot, Thing, access_to
from vla_deploy.world.vocabulary import CONTAINERS

# What another thing may keep where one does not; the other rules are about the robot.
_OF_THE_THING: Final = frozenset({GRASPABLE, PAYLOAD, TAKES_THINGS})
# The parameter that another thing replaces, and in which words.
_REPLACED: Final = {
    "pick_up": ("object", "take the {thing}"),
    "place": ("destination", "put it in the {thing}"),
}


def instead_of(plan: Plan, world: World, scene: Snapshot | None, here: Pose | None) -> str:
    """Return a sentence without a full stop, "" where nothing else is known that would do.

    The actions must be valid one by one, and their dependencies acyclic.
    """
    broken = first_broken(plan.actions, world, scene, here)
    if broken is None or scene is None or not broken.rules.keys() <= _OF_THE_THING:
        return ""
    skill, given = broken.action.skill, broken.action.parameters
    name, phrase = _REPLACED[skill]
    subject = Setting(parameters=given, world=world, scene=scene).subject(name)
    if subject is None or subject.thing is None:
        return ""
    if skill == "pick_up":
        others = others_like(subject.thing, scene, _body(world))
    else:
        others = (one for one in scene.things if one.kind in CONTAINERS and not one.held_by)
    needs = LOGIC[skill].needs
    for other in others:
        setting = Setting(parameters={**given, name: other.thing_id}, world=world, scene=scene)
        if not any(needs[rule](broken.state, setting) for rule in broken.rules):
            return f"I could {phrase.format(thing=other)} ({other.thing_id}) instead"
    return ""


def others_like(thing: Thing, scene: Snapshot, body: Body) -> Iterator[Thing]:
    """Yield things of the kind or the colour that could be taken in place of one."""
    for other in scene.things:
        alike = other.kind == thing.kind or other.colour == thing.colour
        if other is thing or not alike or other.kind not in GRASPABLE_CLASSES:
            continue
        if access_to(other, scene, body).is_accessible:
            yield other


def _body(world: World) -> Body:
    return Body(
        opening_max_m=world.opening_max_m or 0.0, hands=tuple(world.holding), is_free=world.is_free
    )
