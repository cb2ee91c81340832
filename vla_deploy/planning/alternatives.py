"""Say what could be done instead of what the world refuses: take another thing, put it elsewhere.

A replacement keeps the rules that were broken, and nothing is in the way of taking it.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.symbolic.conditions import Setting
from vla_deploy.planning.symbolic.simulation import Broken, first_broken
from vla_deploy.planning.symbolic.state import Pose
from vla_deploy.planning.symbolic.table import GRASPABLE, LOGIC, PAYLOAD, TAKES_THINGS
from vla_deploy.world import Body, Snapshot, Thing, access_to
from vla_deploy.world.vocabulary import CONTAINERS

Candidates = Callable[[Thing, Snapshot, Body], Iterator[Thing]]


def instead_of(plan: Plan, world: World, scene: Snapshot | None, here: Pose | None) -> str:
    """Return a sentence without a full stop, "" where nothing else is known that would do.

    The actions must be valid one by one, and their dependencies acyclic.
    """
    broken = first_broken(plan.actions, world, scene, here)
    if broken is None or scene is None or not broken.rules.keys() <= _OF_THE_THING:
        return ""
    name, phrase, candidates = _REPLACED[broken.action.skill]
    setting = Setting(parameters=broken.action.parameters, world=world, scene=scene)
    subject = setting.subject(name)
    if subject is None or subject.thing is None:
        return ""
    for other in candidates(subject.thing, scene, _body(world)):
        if _keeps_the_rules(broken, {**broken.action.parameters, name: other.thing_id}, setting):
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


def containers(_: Thing, scene: Snapshot, __: Body) -> Iterator[Thing]:
    """Yield what things can be put in."""
    yield from (one for one in scene.things if one.kind in CONTAINERS and not one.held_by)


def _keeps_the_rules(broken: Broken, parameters: Mapping[str, object], setting: Setting) -> bool:
    other = Setting(parameters=parameters, world=setting.world, scene=setting.scene)
    needs = LOGIC[broken.action.skill].needs
    return not any(needs[rule](broken.state, other) for rule in broken.rules)


def _body(world: World) -> Body:
    opening_m = world.opening_max_m
    return Body(
        opening_max_m=0.0 if opening_m is None else opening_m,
        hands=tuple(world.holding),
        is_free=world.is_free,
    )


# What another thing may keep where one does not; the other rules are about the robot.
_OF_THE_THING: Final = frozenset({GRASPABLE, PAYLOAD, TAKES_THINGS})
# The parameter that another thing replaces, in which words, and which things may.
_REPLACED: Final[Mapping[str, tuple[str, str, Candidates]]] = {
    "pick_up": ("object", "take the {thing}", others_like),
    "place": ("destination", "put it in the {thing}", containers),
}
