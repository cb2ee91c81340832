"""Keep accepted plans of language models, which take seconds, while the situation is the same.

Such a model was shown the whole situation, so any change of it makes the kept plan void. Plans of
the other back ends are not kept: they are made anew in a few milliseconds.
"""

import math
import re
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.catalogue import MOTIONLESS
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.interfaces import BackEnd, Proposal, Request
from vla_deploy.world import Thing

MOST_PLANS: Final = 64
LONGEST_S: Final = 3600.0
# How far the robot and things may have moved, and the robot may have turned.
NEAR_M: Final = 0.25
NEAR_RAD: Final = 0.26
# Words whose meaning is in what was said before.
_REFERS_BACK: Final = re.compile(
    r"\b(it|its|that|this|those|these|there|them|they|one|ones|other|others|another|again|same|"
    r"instead|him|her|too|also|no|not|back|more|else|rest)\b"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kept:
    """Hold a plan as it was proposed, for which situation, and since when."""

    proposal: Proposal
    request: Request
    since_ns: int


class PlanCache(BackEnd):
    """Answer a command that a model has planned before.

    What it answers is grounded and checked anew, like any other proposal.
    """

    name = "cache"

    def __init__(self, clock: Clock, most: int = MOST_PLANS, longest_s: float = LONGEST_S) -> None:
        self._clock = clock
        self._most = most
        self._longest_ns = round(longest_s * NS_PER_S)
        self._kept: OrderedDict[str, _Kept] = OrderedDict()
        self._counts = {"hits": 0, "misses": 0, "changed": 0}

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan that was accepted before.

        Raises:
            Declined: there is none, or what it depends on has changed: then it is forgotten.
        """
        del deadline  # a look takes no time
        key = normalised(request.text)
        kept = self._kept.get(key)
        if kept is None:
            self._counts["misses"] += 1
            raise Declined("not planned before")
        is_old = self._clock.now_ns() - kept.since_ns > self._longest_ns
        if is_old or not _is_same(kept.request, request):
            del self._kept[key]
            self._counts["changed"] += 1
            raise Declined("what the plan of before depends on has changed")
        self._kept.move_to_end(key)
        self._counts["hits"] += 1
        return replace(kept.proposal, back_end=self.name, origin=kept.proposal.back_end)

    def keep(self, request: Request, proposal: Proposal) -> None:
        """Remember what a model proposed and was accepted; the oldest may go for it.

        An answer is of the moment: it is not kept.
        """
        only_says = all(action.skill in MOTIONLESS for action in proposal.plan.actions)
        if only_says or not proposal.may_be_kept:
            return
        key = normalised(request.text)
        situation = replace(request, image=None)  # which takes memory, and is not compared
        self._kept[key] = _Kept(proposal=proposal, request=situation, since_ns=self._clock.now_ns())
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


def normalised(text: str) -> str:
    """Return a command so that only what cannot matter is lost: case, white space, a full stop."""
    return " ".join(text.casefold().split()).strip(" .!?")


def _is_same(before: Request, now: Request) -> bool:
    """Return whether one plans the same in two situations."""
    if _facts(before) != _facts(now):
        return False
    spots = zip(_things(before), _things(now), strict=True)  # the same things, by the facts
    if any(math.dist(one.xy_m, other.xy_m) > NEAR_M for one, other in spots):
        return False
    if before.here is None or now.here is None:
        return before.here is now.here
    turned_rad = math.remainder(now.here[2] - before.here[2], math.tau)
    return math.dist(before.here[:2], now.here[:2]) <= NEAR_M and abs(turned_rad) <= NEAR_RAD


def _facts(request: Request) -> tuple[object, ...]:
    gone = () if request.scene is None else request.scene.lost
    refers_back = _REFERS_BACK.search(normalised(request.text))
    turns = request.conversation.turns if refers_back else ()
    return (
        [(turn.said, turn.understood, turn.answer) for turn in turns],
        request.world.holding,
        request.conversation.choices,
        request.recollections,
        request.prohibitions,
        [one.thing.thing_id for one in gone],
        [(one.thing_id, one.kind, one.colour, one.rests, one.held_by) for one in _things(request)],
    )


def _things(request: Request) -> list[Thing]:
    things = () if request.scene is None else request.scene.things
    return sorted(things, key=lambda one: one.thing_id)
