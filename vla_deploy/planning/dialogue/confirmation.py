"""Decide which plans wait for a person's yes: one table of risks, each with what it says of one.

The robot file sets how far it goes (`[planning] require_confirmation`): never, risky, always. What
is unsure is always asked, since it may not be what was asked for.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Set
from typing import Final

from vla_deploy.planning.catalogue import MOTIONLESS
from vla_deploy.planning.dialogue.phrasing import Says, first_part, listed, steps_in_words
from vla_deploy.planning.interfaces import Proposal, Request
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.scope import quoted
from vla_deploy.planning.symbolic.conditions import Setting
from vla_deploy.planning.symbolic.simulation import expected_s
from vla_deploy.planning.symbolic.state import Subject, subject_of
from vla_deploy.robots.plan_bounds import Confirm

Risk = Callable[[Plan, Request], str]

# Below that the words may mean something else, or may have been other words.
SURE: Final = 0.7
SURELY_HEARD: Final = 0.6
MANY_ACTIONS: Final = 25
LONG_S: Final = 900.0
MANY_THINGS: Final = 4
MOST_NAMED: Final = 6
HEAVY_RATIO: Final = 0.8
FAR_BACK_M: Final = -1.0


def confirmation_of(
    plan: Plan,
    request: Request,
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


def question_about(plan: Plan, request: Request, proposal: Proposal | None = None) -> str:
    """Return the question whether a plan is wanted: what may be wrong with it, what it takes."""
    if proposal is not None and proposal.order is not None and proposal.order.question:
        return proposal.order.question
    left_out = () if proposal is None else proposal.left_out
    steps = steps_in_words(_called_by_words(plan, request))
    parts = (
        Says.LEFT_OUT.format(words=first_part(quoted(left_out))) if left_out else "",
        Says.CONFIRM.format(steps=steps),
        *(f"{reason}." for reason in _reasons(plan, request).values() if reason),
        _things_named(plan, request),
    )
    return " ".join(filter(None, parts))


def _things_named(plan: Plan, request: Request) -> str:
    """Return the sentence that names what a plan takes, "" for fewer than two things.

    So a yes can catch an error; of many things it tells the kinds.
    """
    taken = (action.parameters["object"] for action in plan.actions if action.skill == "pick_up")
    subjects = [subject_of(str(text), request.scene) for text in dict.fromkeys(taken)]
    if len(subjects) < 2:
        return ""
    if len(subjects) <= MOST_NAMED:
        return f"That is {listed([_where_it_is(one) for one in subjects])}."
    kinds = Counter(one.kind for one in subjects)
    counted = [
        f"{count} {kind.removesuffix('s')}{'s' * (count > 1)}" for kind, count in kinds.items()
    ]
    return f"That is {len(subjects)} things: {listed(counted)}."


def _where_it_is(subject: Subject) -> str:
    """Return "the red cup on the coffee table", as far as that is known."""
    thing = subject.thing
    if thing is None or thing.rests is None:
        return f"the {thing or subject.words}"
    return f"the {thing} {thing.rests.words}"


def agreement_to(plan: Plan, request: Request) -> frozenset[str]:
    """Return all that a person agrees to with a plan: kinds of risk, and each danger by itself."""
    return frozenset(_reasons(plan, request))


def _reasons(plan: Plan, request: Request) -> dict[str, str]:
    """Return why a plan waits for a yes, by what would be agreed to."""
    if all(action.skill in MOTIONLESS for action in plan.actions):
        return {}
    wanted = request.world.bounds.require_confirmation
    risks = _DOUBTS if wanted is Confirm.NEVER else {**_DOUBTS, **_RISKS}
    whys = {kind: risk(plan, request) for kind, risk in risks.items()}
    found = {why if kind in _EACH else kind: why for kind, why in whys.items() if why}
    return {"any motion": "", **found} if wanted is Confirm.ALWAYS else found


def _called_by_words(plan: Plan, request: Request) -> Plan:
    """Return the plan with "red cup" where it says cup_1: a person knows no ids."""
    things = () if request.scene is None else request.scene.things
    words = {one.thing_id: str(one) for one in things}
    actions = tuple(
        action.model_copy(
            update={
                "parameters": {
                    name: words.get(value, value) if isinstance(value, str) else value
                    for name, value in action.parameters.items()
                }
            }
        )
        for action in plan.actions
    )
    return plan.model_copy(update={"actions": actions})


def _is_unsure(plan: Plan, _: Request) -> str:
    unsure = min((action.feasibility_score for action in plan.actions), default=1.0) < SURE
    return "I am not sure that I understood you" if unsure else ""


def _is_unheard(_: Plan, request: Request) -> str:
    heard = request.heard_confidence
    unheard = heard is not None and heard < SURELY_HEARD
    return "I am not sure that I heard you right" if unheard else ""


def _has_concerns(plan: Plan, _: Request) -> str:
    return (
        f"There may be a danger: {'; '.join(plan.safety_concerns)}" if plan.safety_concerns else ""
    )


def _is_long(plan: Plan, _: Request) -> str:
    long_s = sum(expected_s(action) for action in plan.actions)
    if long_s <= LONG_S and len(plan.actions) <= MANY_ACTIONS:
        return ""
    return f"It takes {len(plan.actions)} steps and about {long_s / 60:.0f} minutes"


def _moves_many(plan: Plan, _: Request) -> str:
    count = sum(action.skill == "pick_up" for action in plan.actions)
    return f"I would move {count} things" if count >= MANY_THINGS else ""


def _is_heavy(plan: Plan, request: Request) -> str:
    limit_kg = HEAVY_RATIO * request.world.bounds.payload_kg
    for action in plan.actions:
        mass_kg = _mass_kg(action, request)
        if mass_kg is not None and mass_kg > limit_kg:
            return f"The {action.parameters['object']} may weigh {mass_kg:.1f} kg"
    return ""


def _mass_kg(action: Action, request: Request) -> float | None:
    setting = Setting(parameters=action.parameters, world=request.world, scene=request.scene)
    subject = setting.subject("object") if action.skill == "pick_up" else None
    return None if subject is None else subject.mass_kg


def _goes_back_far(plan: Plan, _: Request) -> str:
    ways_m = [float(one.parameters["distance_m"]) for one in plan.actions if one.skill == "move"]
    back_m = min(ways_m, default=0.0)
    return f"I would drive {-back_m:g} m backward" if back_m < FAR_BACK_M else ""


_DOUBTS: Final[Mapping[str, Risk]] = {"unsure": _is_unsure, "unheard": _is_unheard}
_RISKS: Final[Mapping[str, Risk]] = {
    "danger": _has_concerns,
    "long": _is_long,
    "many": _moves_many,
    "heavy": _is_heavy,
    "far back": _goes_back_far,
}
# A yes to one of these is none to another one.
_EACH: Final = frozenset({"danger", "heavy"})
