"""Plan one command: what answers at once first, what takes time after it, in one time for all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Protocol, runtime_checkable

from drivers.clock import Clock
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.aids import Aid
from vla_deploy.planning.asking import Proposal, Request, Rung
from vla_deploy.planning.correction import CORRECTED
from vla_deploy.planning.dialects import Json, parse_plan
from vla_deploy.planning.errors import Declined, NotUnderstood
from vla_deploy.planning.ladder import Answer, Check, Ladder
from vla_deploy.planning.patterns.backend import Patterns
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.plan_cache import PlanCache
from vla_deploy.planning.prohibitions import held_to
from vla_deploy.planning.understanding.grounding import ground_plan
from vla_deploy.planning.validator import check_plan

WITHIN_S: Final = 20.0


def checked(plan: Plan, request: Request) -> Plan:
    """Return a plan grounded in the world of a request, and valid there.

    Raises:
        PlanInvalid: it may not run; carries every fault.
        Ambiguous: only the person can tell what is meant.
        PlanningError: it speaks of what the robot does not know.
    """
    grounded = ground_plan(plan, request)
    check_plan(grounded, request.world, request.scene, request.here)
    return held_to(request.prohibitions, grounded, request.world, request.scene)


@runtime_checkable
class Served(Protocol):
    """Tell more of a rung that asks a server."""

    def document(self) -> dict[str, Any]:
        """Return how its server has been doing."""
        ...


@runtime_checkable
class Aided(Protocol):
    """Tell what a rung puts before its model, besides command and scene."""

    @property
    def aids(self) -> frozenset[Aid]:
        """Return what it can use."""
        ...


@runtime_checkable
class Held(Protocol):
    """Let go of what a rung holds in memory."""

    def close(self) -> None:
        """Release it."""
        ...


class Planner:
    """Hold the parts of the ladder; the slow one is climbed beside a process' steps.

    `away` tells which servers it should ask and cannot, with the reason.
    """

    def __init__(
        self,
        clock: Clock,
        slow: Sequence[Rung] = (),
        *,
        within_s: float = WITHIN_S,
        check: Check = checked,
        away: Mapping[str, str] | None = None,
    ) -> None:
        self.cache = PlanCache(clock)
        self.within_s = within_s
        self.away = dict(away or {})
        self._clock = clock
        self.check = check
        self._quick = Ladder((Patterns(), self.cache), check, clock)
        self._slow = Ladder(slow, check, clock)

    @property
    def _ladders(self) -> tuple[Ladder, ...]:
        return self._quick, self._slow

    @property
    def rungs(self) -> tuple[str, ...]:
        """Return the names of all rungs, in the order in which they are asked."""
        return tuple(rung.name for ladder in self._ladders for rung in ladder.rungs)

    @property
    def slow_rungs(self) -> tuple[str, ...]:
        """Return the names of the rungs that take time."""
        return tuple(rung.name for rung in self._slow.rungs)

    @property
    def uses(self) -> frozenset[Aid]:
        """Return what any of the rungs can use."""
        aided = [rung.aids for rung in self._slow.rungs if isinstance(rung, Aided)]
        return frozenset(one for aids in aided for one in aids)

    def document(self) -> dict[str, Any]:
        """Return how cache and servers have been doing, as JSON takes it."""
        servers = [rung.document() for rung in self._slow.rungs if isinstance(rung, Served)]
        return {
            "rungs": list(self.rungs),
            "cache": self.cache.document(),
            "servers": servers,
            "away": self.away,
        }

    def close(self) -> None:
        """Release the models on board; planning after that does without them."""
        for rung in self._slow.rungs:
            if isinstance(rung, Held):
                rung.close()

    def plan(self, request: Request) -> Answer:
        """Return the answer of all rungs together; blocks until then."""
        deadline = Deadline.within(self._clock, self.within_s)
        answer = self.plan_at_once(request, deadline)
        return answer if answer.is_final else self.plan_slowly(request, deadline, answer)

    def plan_at_once(self, request: Request, deadline: Deadline) -> Answer:
        """Return the answer of the rungs that take no time."""
        answer = self._quick.climb(request, deadline)
        return answer if self._slow.rungs else _worded(answer, request)

    def plan_slowly(self, request: Request, deadline: Deadline, before: Answer) -> Answer:
        """Return the answer of the others too; blocks until the deadline at most."""
        return _worded(self._slow.climb(request, deadline, before), request)

    def check_given(self, document: Json | list[object] | str, request: Request) -> Answer:
        """Return the answer to a plan that somebody made elsewhere, in any dialect."""
        deadline = Deadline.within(self._clock, self.within_s)
        return Ladder((_GivenPlan(document),), self.check, self._clock).climb(request, deadline)

    def accepted(self, request: Request, answer: Answer) -> None:
        """Remember a plan that was handed on; what patterns make is made anew as fast."""
        proposal = answer.proposal
        if proposal is not None and proposal.rung not in _NOT_KEPT:
            self.cache.keep(request, proposal)


@dataclass(frozen=True, slots=True)
class _GivenPlan:
    """Propose a plan that came with the command."""

    document: Json | list[object] | str
    name: str = field(default="given", init=False)

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        del request, deadline  # the plan is there already
        return Proposal(plan=parse_plan(self.document), rung=self.name, confidence=1.0)


_NOT_KEPT: Final = frozenset({Patterns.name, PlanCache.name, "given", CORRECTED})


def _worded(answer: Answer, request: Request) -> Answer:
    """Say to a person that nobody understood, where no rung has said more."""
    if isinstance(answer.error, Declined):
        return replace(answer, error=NotUnderstood(request.text))
    return answer
