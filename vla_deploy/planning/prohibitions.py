"""Keep what a person has forbidden, until they take it back: things to touch, places to enter.

A prohibition stands over restarts of the planner. The check of every plan asks here, whoever has
planned it.
"""

import json
import logging
import math
import re
from collections.abc import Collection, Sequence, Set
from dataclasses import asdict
from pathlib import Path
from typing import Final, Self

from vla_deploy.planning.errors import CannotBeDone, NotAble
from vla_deploy.planning.interfaces import (
    Forbidden,
    PlanRequest,
    Prohibition,
    Proposal,
    StandingOrder,
)
from vla_deploy.planning.patterns.phrase import courtesy_off
from vla_deploy.planning.patterns.table import WORDS
from vla_deploy.plans.knowledge import World, match_place, object_or_none
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.plans.symbolic.state import thing_of
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.world import Snapshot
from vla_deploy.world.vocabulary import ANY_CLASS

REACH_M: Final = 1.0
"""What is this near to a place is there: the pose of a place says not where it ends."""
FILE_NAME: Final = "prohibitions.json"
MOST: Final = 32
_log = logging.getLogger(__name__)


class Prohibitions:
    """Hold all of them, and their file where there is one."""

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self.items: tuple[Prohibition, ...] = _read(file) if file is not None else ()

    @classmethod
    def of_base(cls, base: Path) -> Self:
        """Return those of a runtime directory."""
        return cls(state_dir_of(base) / FILE_NAME)

    def document(self) -> list[str]:
        """Return what is forbidden, as one says it."""
        return [str(one) for one in self.items]

    def apply(self, order: StandingOrder) -> None:
        """Forbid, or permit again; the oldest of too many go."""
        kept = tuple(one for one in self.items if one != order.of)
        self.items = (*kept, order.of)[-MOST:] if order.forbids else kept
        if self._file is not None:
            _write(self._file, self.items)


_OF: Final = rf"(?P<of>{WORDS})"
_TOUCH: Final = "(?:touch|move|lay a (?:hand|finger) on|go near)"
_ENTER: Final = "(?:go|drive|come|enter)(?: back)?(?: in| into| to)?"
_NOT: Final = "(?:don't|do not|never|you must not|you mustn't|you may not)"
_EVER: Final = r"(?: again| ever| ever again| any ?more| from now on)"
# "Don't go there" is about now; a thing is not to be touched until somebody says so.
_FORBIDS: Final = tuple(
    re.compile(pattern)
    for pattern in (
        rf"{_NOT}(?: ever)? {_TOUCH} {_OF}{_EVER}?",
        rf"(?:never|(?:don't|do not) ever|you (?:must not|mustn't|may not)) {_ENTER} {_OF}{_EVER}?",
        rf"{_NOT} {_ENTER} {_OF}{_EVER}",
        rf"(?:leave|let) {_OF} (?:alone|be)",
        rf"(?:(?:keep your )?hands off|(?:stay|keep) out of) {_OF}",
    )
)
_PERMITS: Final = (
    re.compile(
        rf"(?:you (?:may|can) (?:{_TOUCH}|{_ENTER})|forget what i said about) {_OF}(?: again)?"
    ),
)


def read_order(text: str, world: World, standing: Sequence[Prohibition]) -> StandingOrder | None:
    """Return what a command forbids for good, or permits again; None for any other command.

    What stands already is what may be permitted: "you can go to the kitchen" is a command, too.
    """
    clause = courtesy_off(text)
    for forbids, patterns in ((True, _FORBIDS), (False, _PERMITS)):
        for pattern in patterns:
            found = pattern.fullmatch(clause)
            meant = None if found is None else _meant([found["of"]], world)
            if meant is not None and (forbids or meant in standing):
                return StandingOrder(forbids=forbids, of=meant)
    return None


def order_of(said: Collection[str], forbids: bool, request: PlanRequest) -> StandingOrder:
    """Return the order about what some words name.

    Raises:
        CannotBeDone: they name nothing that may be forbidden, or that is not forbidden.
    """
    meant = _meant(said, request.world)
    if meant is None:
        raise CannotBeDone('say what: "don\'t touch the keys", "you may go into the kitchen again"')
    if not forbids and meant not in request.prohibitions:
        raise CannotBeDone(f"nobody has told me not to {meant}")
    return StandingOrder(forbids=forbids, of=meant)


def proposal_of(order: StandingOrder, request: PlanRequest, back_end: str) -> Proposal:
    """Return the proposal to say that an order stands from now on."""
    said = Action(id="a1", skill="speak", parameters={"text": order.answer})
    plan = Plan(goal=request.text.strip(), summary=order.answer, actions=(said,))
    return Proposal(plan=plan, back_end=back_end, confidence=1.0, covers=None, order=order)


def held_to(
    standing: Sequence[Prohibition], plan: Plan, world: World, scene: Snapshot | None
) -> Plan:
    """Return a grounded plan that keeps out of what is forbidden, also where it only searches.

    Raises:
        NotAble: it does what is forbidden; says what, and how it is permitted again.
    """
    for one in standing:
        if any(_breaks(action, one, world, scene) for action in plan.actions):
            raise NotAble(f'you told me not to {one}; say "you may {one} again" first')
    closed = (world.surfaces_of(one.words) for one in standing if one.what is Forbidden.PLACE)
    places = frozenset[str]().union(*closed)
    return plan.model_copy(update={"keeps_out": tuple(sorted(places))})


def _meant(said: Collection[str], world: World) -> Prohibition | None:
    """Return the prohibition about the place, else about the thing that some words name."""
    for place in filter(None, (match_place(one, world.places) for one in said)):
        return Prohibition(what=Forbidden.PLACE, words=place)
    for thing in filter(None, map(object_or_none, said)):
        return Prohibition(what=Forbidden.THING, words=str(thing))
    return None


def _breaks(action: Action, one: Prohibition, world: World, scene: Snapshot | None) -> bool:
    given = action.parameters
    if one.what is Forbidden.THING:
        touched = [given.get("object")] if action.skill == "pick_up" else []
        touched += [given.get("destination")] if action.skill == "place" else []
        return any(_may_be(str(text), one.words, scene) for text in touched if text)
    inside = world.surfaces_of(one.words)
    if "x_m" in given and "y_m" in given:
        return _is_near((float(given["x_m"]), float(given["y_m"])), inside, world)
    named = {str(given[name]) for name in ("place", "destination") if name in given}
    return bool(inside & (named | _rests(given.get("object"), scene)))


def _is_near(point: tuple[float, float], places: Set[str], world: World) -> bool:
    """Return whether a point of the map is at one of the places: no map says where rooms end."""
    poses = (site.pose for name, site in world.sites.items() if name in places)
    return any(math.dist(point, (one.x_m, one.y_m)) <= REACH_M for one in poses)


def _may_be(text: str, words: str, scene: Snapshot | None) -> bool:
    """Return whether an action names a forbidden thing; one that is not seen may be, if it can."""
    thing, asked, query = thing_of(text, scene), object_or_none(text), object_or_none(words)
    if asked is None or query is None:
        return False
    if thing is not None and scene is not None:
        return any(one.thing_id == thing.thing_id for one in query.among(scene))
    colours = {asked.colour, query.colour} - {""}
    return len({asked.kind, query.kind} - {ANY_CLASS}) < 2 and len(colours) < 2


def _rests(text: object, scene: Snapshot | None) -> set[str]:
    """Return all that a thing rests on which an action names, where that is known."""
    thing = thing_of(text, scene)
    return set() if thing is None or scene is None else {*scene.below(thing.thing_id)}


def _read(file: Path) -> tuple[Prohibition, ...]:
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
        return tuple(
            Prohibition(what=Forbidden(one["what"]), words=str(one["words"])) for one in told[:MOST]
        )
    except FileNotFoundError:
        return ()
    except (OSError, ValueError, TypeError, KeyError) as error:
        _log.error("%s cannot be read, so nothing is forbidden: %s; say it anew", file, error)
        return ()


def _write(file: Path, items: Sequence[Prohibition]) -> None:
    """Write the file as a whole; a robot that cannot keep it still obeys until it is restarted."""
    fresh = file.with_suffix(".new")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_text(json.dumps([asdict(one) for one in items]) + "\n", encoding="utf-8")
        fresh.replace(file)
    except OSError as error:
        _log.error("what is forbidden is not kept over a restart: %s", error)
