"""Decide which plans wait for a person's yes: a list of risks, each with what it says of one.

The robot file sets how far it goes (`[planning] require_confirmation`): never, risky, always. What
is unsure is always asked, since it may not be what was asked for.
"""

from collections.abc import Iterator, Set
from typing import Final

from vla_deploy.planning.dialogue.phrasing import Says, first_part, listed, steps_in_words
from vla_deploy.planning.interfaces import PlanRequest, Proposal
from vla_deploy.planning.scope import quoted
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.plan import Plan
from vla_deploy.plans.symbolic.state import subject_of
from vla_deploy.robots.plan_bounds import Confirm

# Below that the words may mean something else, or may have been other words.
SURE: Final = 0.7
SURELY_HEARD: Final = 0.6
MANY_THINGS: Final = 4
MOST_NAMED: Final = 6
HEAVY_RATIO: Final = 0.8
FAR_BACK_M: Final = -1.0


def confirmation_of(
    plan: Plan,
    request: PlanRequest,
    proposal: Proposal | None = None,
    agreed: Set[str] = frozenset(),
) -> str:
    """Return the question to ask before a plan runs, or "" where it may run at once.

    What was `agreed` to before is not asked about again; what its back end doubts is.
    """
    is_read_back = proposal is not None and proposal.is_read_back
    if not is_read_back and _reasons(plan, request).keys() <= agreed:
        return ""
    return question_about(plan, request, proposal)


def question_about(plan: Plan, request: PlanRequest, proposal: Proposal | None = None) -> str:
    """Return the question whether a plan is wanted, with what may be wrong with it."""
    if proposal is not None and proposal.order is not None and proposal.order.question:
        return proposal.order.question
    left_out = () if proposal is None else proposal.left_out
    things = () if request.scene is None else request.scene.things
    steps = steps_in_words(plan, {one.thing_id: str(one) for one in things})
    parts = (
        Says.LEFT_OUT.format(words=first_part(quoted(left_out))) if left_out else "",
        Says.CONFIRM.format(steps=steps),
        *(f"{reason}." for reason in _reasons(plan, request).values() if reason),
    )
    return " ".join(filter(None, parts))


def agreement_to(plan: Plan, request: PlanRequest) -> frozenset[str]:
    """Return all that a person agrees to with a plan: kinds of risk, and each danger by itself."""
    return frozenset(_reasons(plan, request))


def _reasons(plan: Plan, request: PlanRequest) -> dict[str, str]:
    """Return why a plan waits for a yes, by what would be agreed to."""
    if all(action.skill in MOTIONLESS for action in plan.actions):
        return {}
    wanted = request.world.bounds.require_confirmation
    found = {"any motion": ""} if wanted is Confirm.ALWAYS else {}
    found |= dict(_doubts(plan, request))
    return found if wanted is Confirm.NEVER else found | dict(_risks(plan, request))


def _doubts(plan: Plan, request: PlanRequest) -> Iterator[tuple[str, str]]:
    """Yield what is unsure, since it may not be what was asked for."""
    if min(action.feasibility_score for action in plan.actions) < SURE:
        yield "unsure", "I am not sure that I understood you"
    heard = request.heard_confidence
    if heard is not None and heard < SURELY_HEARD:
        yield "unheard", "I am not sure that I heard you right"


def _risks(plan: Plan, request: PlanRequest) -> Iterator[tuple[str, str]]:
    """Yield each risk; a yes to one danger, or one heavy thing, is none to another."""
    for concern in plan.safety_concerns:
        yield concern, f"There may be a danger: {concern}"
    taken = [str(one.parameters["object"]) for one in plan.actions if one.skill == "pick_up"]
    subjects = [subject_of(text, request.scene) for text in taken]
    names = [f"the {one.thing or one.words}" for one in subjects]
    if len(names) >= MANY_THINGS:
        rest = len(names) - MOST_NAMED
        told = listed([*names[:MOST_NAMED], *([f"{rest} more"] if rest > 0 else [])])
        yield "many", f"I would move {len(names)} things: {told}"
    for name, subject in zip(names, subjects, strict=True):
        mass_kg = subject.mass_kg
        if mass_kg is not None and mass_kg > HEAVY_RATIO * request.world.bounds.payload_kg:
            yield f"{name} is heavy", f"{name.capitalize()} may weigh {mass_kg:.1f} kg"
    ways_m = [float(one.parameters["distance_m"]) for one in plan.actions if one.skill == "move"]
    if min(ways_m, default=0.0) < FAR_BACK_M:
        yield "far back", f"I would drive {-min(ways_m):g} m backward"
