"""Judge the success criteria of missions, which are short English, against the known world.

holding the red cup          the hands are empty        at the kitchen
the red cup is in the box    no cup on the coffee table    nothing on the dining table
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from vla_deploy.missions.errors import MissionInvalid
from vla_deploy.plans.errors import UnknownObject
from vla_deploy.plans.knowledge import World, match_place, parse_object
from vla_deploy.plans.symbolic.state import Pose, state_of, subject_or_none
from vla_deploy.world import Snapshot, UnknownWord, parse_query
from vla_deploy.world.query import find
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.thing import Rest

AT_M: Final = 0.6
"""A robot that stands so near to where one stands for a place is there."""
MET: Final = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Hold what is known when a criterion is judged."""

    world: World
    scene: Snapshot | None = None
    here: Pose | None = None


# MET, why it is not met, or None where nobody knows.
Verdict = str | None
Judge = Callable[[Facts], Verdict]


def judge(text: str, facts: Facts) -> Verdict:
    """Return MET, why a criterion is not met, or None where it cannot be judged.

    Raises:
        MissionInvalid: no form of criterion fits the text, or it names what is not known.
    """
    return read_criterion(text, facts.world)(facts)


def read_criterion(text: str, world: World) -> Judge:
    """Return how to judge a criterion.

    Raises:
        MissionInvalid: no form of criterion fits the text, or it names what is not known.
    """
    said = " ".join(re.sub(r"[_.,!]+", " ", text.lower()).split())
    for pattern, read in _FORMS:
        if found := pattern.fullmatch(said):
            try:
                return read(found, world)
            except (UnknownObject, UnknownWord) as error:
                raise MissionInvalid([f'criterion "{text}": {error}']) from error
    raise MissionInvalid(
        [
            f'criterion "{text}" cannot be checked; write for example "holding the red cup", '
            '"the hands are empty", "at the kitchen", "the cup is in the box", '
            '"nothing on the coffee table"'
        ]
    )


def _holding(found: re.Match[str], world: World) -> Judge:
    del world
    query = parse_object(found["what"])

    def judged(facts: Facts) -> Verdict:
        state = state_of(facts.world, facts.scene, facts.here)
        if not state.hands:
            return None
        subject = subject_or_none(str(query), facts.scene)
        keys = {query.kind} if subject is None else {subject.key, subject.kind}
        held = [one.key for one in state.held]
        if any(one.key in keys or one.kind == query.kind for one in state.held):
            return MET
        return f"the hands hold {', '.join(held) or 'nothing'}"

    return judged


def _hands_empty(found: re.Match[str], world: World) -> Judge:
    del found, world

    def judged(facts: Facts) -> Verdict:
        state = state_of(facts.world, facts.scene, facts.here)
        if not state.hands:
            return None
        return "; ".join(f"a hand holds {one.key}" for one in state.held)

    return judged


def _at(found: re.Match[str], world: World) -> Judge:
    place = match_place(found["where"], world.places)
    if place is None:
        return _near_thing(found["where"])
    site = world.sites[place]

    def judged(facts: Facts) -> Verdict:
        if facts.here is None:
            return None
        away_m = math.dist((site.pose.x_m, site.pose.y_m), facts.here[:2])
        return MET if away_m <= AT_M else f"the robot is {away_m:.1f} m from the {place}"

    return judged


def _near_thing(what: str) -> Judge:
    query = parse_object(what)

    def judged(facts: Facts) -> Verdict:
        things = find(query, facts.scene) if facts.scene is not None else []
        if not things or facts.here is None:
            return None
        away_m = math.dist(things[0].xy_m, facts.here[:2])
        return MET if away_m <= 2 * AT_M else f"the robot is {away_m:.1f} m from the {query}"

    return judged


def _related(found: re.Match[str], world: World) -> Judge:
    what, relation, of = found["what"], found["relation"], found["of"]
    query = parse_query(f"{what} {relation} {of}", world.places)
    alone = parse_query(what, world.places)

    def judged(facts: Facts) -> Verdict:
        if facts.scene is None or not find(alone, facts.scene):
            return None
        if find(query, facts.scene):
            return MET
        rests = find(alone, facts.scene)[0].rests
        return f"the {alone} is {rests.words if rests else 'elsewhere'}"

    return judged


def _none_on(found: re.Match[str], world: World) -> Judge:
    kind, relation = found["what"], found["relation"]
    query = None if kind in ("nothing", "thing", "things", "objects") else parse_query(kind)
    surface = match_place(found["of"], world.places)
    if surface is None:
        raise UnknownWord(found["of"], found["of"], tuple(sorted(set(world.places.values()))))
    surface = world.surface_of(surface)

    def judged(facts: Facts) -> Verdict:
        if facts.scene is None:
            return None
        left = [
            one.thing_id
            for one in facts.scene.things
            if one.rests == Rest(IN if relation == "in" else ON, surface)
            and (query is None or query.fits(one))
        ]
        return f"still there: {', '.join(left)}" if left else MET

    return judged


def _clear(found: re.Match[str], world: World) -> Judge:
    return read_criterion(f"nothing on {found['of']}", world)


_ROBOT: Final = r"(?:the )?(?:robot )?(?:is )?"
_IS: Final = r"(?: (?:is|are))?"
_FORMS: Final = tuple(
    (re.compile(pattern), read)
    for pattern, read in (
        (rf"(?:the )?(?:hands?|grippers?){_IS} (?:empty|free)", _hands_empty),
        (rf"{_ROBOT}(?:holding|holds|grasped|has|carrying) (?P<what>.+)", _holding),
        (rf"(?P<what>.+?){_IS} (?:held|grasped|in (?:the )?(?:hand|gripper))", _holding),
        (rf"{_ROBOT}at (?:the )?(?P<where>.+?)(?: location)?", _at),
        (r"(?:the )?robot (?:is )?in (?:the )?(?P<where>.+?)", _at),
        (rf"(?P<what>nothing){_IS} (?P<relation>on|in) (?P<of>.+)", _none_on),
        (rf"no (?P<what>.+?){_IS} (?P<relation>on|in) (?P<of>.+)", _none_on),
        (rf"(?P<of>.+?){_IS} clear", _clear),
        (rf"(?P<what>.+?){_IS} (?P<relation>in|on|next to|near|under) (?P<of>.+)", _related),
    )
)
