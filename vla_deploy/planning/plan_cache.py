"""Keep plans that were accepted, for the same command while what they depend on is the same."""

import math
import re
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.asking import Proposal, Request
from vla_deploy.planning.confirmation import STILL
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.symbolic.state import Point, Pose
from vla_deploy.world import Query, Snapshot, Thing, UnknownWord, parse_query

MOST_PLANS: Final = 64
LONGEST_S: Final = 3600.0
# How far robot and things may have moved: little where a plan has coordinates, or where whoever saw
# them all chose some by their ids or spoke of them; else within the same part of the room.
_CLOSE: Final = (0.25, 0.26)  # m, rad
_ROOM: Final = (1.0, math.inf)
_COORDINATES: Final = frozenset({"x_m", "y_m", "yaw_rad"})
_SPOKEN_OF: Final = ("object", "destination")
# Words whose meaning is in what was said before.
_REFERS_BACK: Final = re.compile(
    r"\b(it|its|that|this|those|these|there|them|they|one|ones|other|others|another|again|same|"
    r"instead|him|her|too|also|no|not|back|more|else|rest)\b"
)

Facts = tuple[object, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Context:
    """Hold what a plan depends on: facts, and where robot and things were, as far as that counts.

    `within` is how far they may have moved, and the robot turned, in metres and radians.
    """

    facts: Facts
    pose: Pose | None = None
    spots: tuple[Point, ...] = ()
    within: tuple[float, float] = _ROOM

    def is_like(self, other: "Context") -> bool:
        """Tell whether one plans the same in another context."""
        if self.facts != other.facts or (self.pose is None) != (other.pose is None):
            return False
        reach_m, turn_rad = self.within
        spots = zip(self.spots, other.spots, strict=True)  # of the same things, by the facts
        has_moved = any(math.dist(before, now) > reach_m for before, now in spots)
        return not has_moved and self._stands_like(other, reach_m, turn_rad)

    def _stands_like(self, other: "Context", reach_m: float, turn_rad: float) -> bool:
        if self.pose is None or other.pose is None:
            return True
        turned_rad = math.remainder(other.pose[2] - self.pose[2], math.tau)
        return math.dist(self.pose[:2], other.pose[:2]) <= reach_m and abs(turned_rad) <= turn_rad


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kept:
    """Hold a plan as it was proposed, what it depends on, and since when."""

    proposal: Proposal
    context: Context
    since_ns: int


class PlanCache:
    """Answer a command that was planned before, as the second rung of the ladder.

    What it answers is grounded and checked anew, like any other proposal.
    """

    name: Final = "cache"

    def __init__(self, clock: Clock, most: int = MOST_PLANS, longest_s: float = LONGEST_S) -> None:
        self._clock = clock
        self._most = most
        self._longest_ns = round(longest_s * NS_PER_S)
        self._kept: OrderedDict[str, _Kept] = OrderedDict()
        self._counts = {"hits": 0, "misses": 0, "changed": 0}

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan that was accepted before.

        Raises:
            Declined: there is none, the words were hardly heard this time, or what it depends on
                has changed: then it is forgotten.
        """
        del deadline  # a look takes no time
        key = normalised(request.text)
        kept = self._kept.get(key)
        if kept is None:
            self._counts["misses"] += 1
            raise Declined("not planned before")
        if self._has_changed(kept, request):
            del self._kept[key]
            self._counts["changed"] += 1
            raise Declined("what the plan of before depends on has changed")
        self._kept.move_to_end(key)
        self._counts["hits"] += 1
        origin = kept.proposal.origin or kept.proposal.rung
        proposal = replace(kept.proposal, rung=self.name, origin=origin)
        return proposal.as_heard(request.heard_confidence)

    def keep(self, request: Request, proposal: Proposal) -> None:
        """Remember what a rung proposed and was accepted; the oldest may go for it.

        An answer, and what was made of an image, is of the moment: it is not kept.
        """
        if _is_momentary(proposal):
            return
        key = normalised(request.text)
        context = context_of(request, proposal)
        self._kept[key] = _Kept(proposal=proposal, context=context, since_ns=self._clock.now_ns())
        self._kept.move_to_end(key)
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)

    def forget(self, text: str) -> None:
        """Drop what is kept for a command: the plan has failed."""
        self._kept.pop(normalised(text), None)

    def document(self) -> dict[str, Any]:
        """Return how it has been doing; the rate is null before the first look."""
        looks = sum(self._counts.values())
        rate = round(self._counts["hits"] / looks, 4) if looks else None
        return {**self._counts, "plans": len(self._kept), "hit_rate": rate}

    def _has_changed(self, kept: _Kept, request: Request) -> bool:
        is_old = self._clock.now_ns() - kept.since_ns > self._longest_ns
        return is_old or not kept.context.is_like(context_of(request, kept.proposal))


def normalised(text: str) -> str:
    """Return a command so that only what cannot matter is lost: case, white space, a full stop."""
    return " ".join(text.casefold().split()).strip(" .!?")


def context_of(request: Request, proposal: Proposal) -> Context:
    """Return everything that a plan for the command depends on.

    Whoever was shown the whole scene may have used all of it, and where it all is.
    """
    scene, saw_all = request.scene, proposal.saw_scene
    things = () if scene is None else scene.things if saw_all else _spoken_of(proposal.plan, scene)
    known = sorted(things, key=lambda one: one.thing_id)
    gone = tuple(one.thing.thing_id for one in scene.lost) if scene is not None else ()
    return Context(
        facts=(
            tuple(sorted(request.world.holding.items(), key=str)),
            tuple(map(_told, known)),
            _said_before(request),
            request.here is None,
            (request.recollections, gone) if saw_all else (),
        ),
        pose=request.here if saw_all or _has_coordinates(proposal.plan) else None,
        spots=tuple(one.xy_m for one in known) if saw_all else (),
        within=_CLOSE if _is_of_places(proposal) else _ROOM,
    )


def _is_momentary(proposal: Proposal) -> bool:
    """Tell whether a plan holds what was read when it was made, and nothing later can confirm."""
    only_tells = all(action.skill in STILL for action in proposal.plan.actions)
    return proposal.is_momentary or (proposal.saw_scene and only_tells)


def _is_of_places(proposal: Proposal) -> bool:
    """Tell whether a plan may be another one where things stand a little farther away."""
    if _has_coordinates(proposal.plan):
        return True
    return proposal.saw_scene and any(
        action.skill == "speak" or _names_id(action) for action in proposal.plan.actions
    )


def _names_id(action: Action) -> bool:
    queries = (_query(action.parameters.get(name)) for name in _SPOKEN_OF)
    return any(query is not None and query.thing_id for query in queries)


def _spoken_of(plan: Plan, scene: Snapshot) -> Iterator[Thing]:
    """Yield the things that a plan may mean, and what they must be told from."""
    for action in plan.actions:
        for name in _SPOKEN_OF:
            query = _query(action.parameters.get(name))
            if query is not None:
                yield from (one for one in scene.things if query.fits(one))


def _query(words: object) -> Query | None:
    if not isinstance(words, str):
        return None
    try:
        return parse_query(words)
    except UnknownWord:  # a place, which does not change
        return None


def _told(thing: Thing) -> tuple[str, ...]:
    rests = (thing.rests.relation, thing.rests.of) if thing.rests else ("", "")
    return (thing.thing_id, thing.kind, thing.colour, *rests, thing.held_by)


def _has_coordinates(plan: Plan) -> bool:
    return any(_COORDINATES & action.parameters.keys() for action in plan.actions)


def _said_before(request: Request) -> Facts:
    talk = request.conversation
    settled = tuple(sorted(talk.choices.items()))
    if not _REFERS_BACK.search(normalised(request.text)):
        return settled
    return (settled, tuple((turn.said, turn.understood, turn.answer) for turn in talk.turns))
