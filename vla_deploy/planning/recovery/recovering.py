"""Find the first strategy whose plan may run in the world as it is now."""

import re
from collections.abc import Mapping
from typing import Final

from vla_deploy.planning.errors import CannotBeDone, PlanningError
from vla_deploy.planning.interfaces import Answer, Check, Proposal, Request
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.recovery.setback import Carried
from vla_deploy.planning.recovery.strategies import STRATEGIES, Steps

RECOVERY: Final = "recovery"
_CONFIDENCE: Final = 0.8
_UNCLEAR: Final = "nobody knows how much of the way was done"
_ID_CHARACTERS: Final = 64
_BEFORE: Final = re.compile(r"^(?:r\d+_)+")


def recover(carried: Carried, request: Request, check: Check) -> Answer:
    """Return a plan that mends the last setback, or why none of the strategies has one.

    The proposal's `origin` names the strategy. Where nobody knows how much of a drive or a turn was
    done, none is tried: it would be done again.
    """
    if not carried.setbacks[-1].is_clear:
        return Answer(error=CannotBeDone(f"{carried.setbacks[-1].error} ({_UNCLEAR})"))
    refusals = []
    for name, strategy in STRATEGIES.items():
        steps = None if carried.tried(name) else strategy(carried, request)
        if not steps:
            continue
        proposal = Proposal(
            plan=_mended(carried.plan, steps, name),
            rung=RECOVERY,
            confidence=_CONFIDENCE,
            origin=name,
        )
        try:
            return Answer(plan=check(proposal.plan, request), proposal=proposal)
        except PlanningError as error:
            refusals.append(f"{name}: {error}")
    why = "; ".join(refusals) or "nothing else is left to try"
    return Answer(error=CannotBeDone(f"{carried.setbacks[-1].error} ({why})"))


def numbered(plan: Plan, number: int) -> Plan:
    """Return a recovery's plan whose actions no one takes for those of the plans before it."""
    own = {one.id: _BEFORE.sub("", one.id) for one in plan.actions}
    names = {name: f"r{number}_{short}"[:_ID_CHARACTERS] for name, short in own.items()}
    if len(set(names.values())) < len(names):
        names = {one.id: f"r{number}_{place}" for place, one in enumerate(plan.actions)}
    return plan.model_copy(update={"actions": tuple(_renamed(one, names) for one in plan.actions)})


def _renamed(action: Action, names: Mapping[str, str]) -> Action:
    needed = tuple(names[one] for one in action.depends_on)
    return action.model_copy(update={"id": names[action.id], "depends_on": needed})


def _mended(plan: Plan, steps: Steps, strategy: str) -> Plan:
    return plan.model_copy(
        update={"actions": steps, "reasoning": f"after a failure: {strategy}", "feasible": True}
    )
