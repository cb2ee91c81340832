"""Ground a plan: referring expressions become ids, words or places, what is missing is put in.

One function for every planner: rules, the command parser, models behind servers, a person's own
JSON. Each may say "pick up it" and leave the way there out; what they say too much is left out.
"""

from dataclasses import dataclass, replace
from typing import Final

from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.errors import PlanInvalid
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import (
    MOST_ACTIONS,
    PUT_IN,
    Action,
    Plan,
    dependency_faults,
    execution_order,
)
from vla_deploy.planning.symbolic import LOGIC, after, state_of
from vla_deploy.planning.symbolic.sharing import in_turn
from vla_deploy.planning.understanding.conversation import Mention
from vla_deploy.planning.understanding.decisions import Decision, reasoning
from vla_deploy.planning.understanding.destinations import Parameters
from vla_deploy.planning.understanding.insertions import missing_before
from vla_deploy.planning.understanding.normaliser import free_id, normalised, with_unique_ids
from vla_deploy.planning.understanding.referring import grounded_steps
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.planning.validator import action_faults

# A free hand takes two steps, then the thing is looked for and driven to.
MOST_INSERTED: Final = 6
# Doing these a second time at once changes nothing.
IDEMPOTENT: Final = frozenset(
    {"navigate_to", "look_at", "find_object", "open_gripper", "close_gripper", "move_arm", "stop"}
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Grounded:
    """Hold a plan that names nothing but what the robot knows, and how it came to that.

    `inserted` are the ids of actions that were put in, `certainty` how sure the least sure decision
    is, 0 to 1.
    """

    plan: Plan
    decisions: tuple[Decision, ...] = ()
    mentions: tuple[Mention, ...] = ()
    inserted: frozenset[str] = frozenset()
    certainty: float = 1.0


def ground_plan(plan: Plan, request: Request) -> Grounded:
    """Return the plan as it can be validated and carried out.

    Raises:
        PlanInvalid: its dependencies are no order.
        UnknownObject: an expression names nothing that the robot knows.
        UnknownPlace: a place is not known.
        Ambiguous: only the speaker can tell what is meant.
    """
    actions = with_unique_ids(plan.actions)
    faults = dependency_faults(actions)
    if faults:
        raise PlanInvalid(faults)
    grounder = _Grounder(request)
    for action in execution_order(actions):
        grounder.add(action)
    if len(grounder.done) > MOST_ACTIONS:
        raise PlanInvalid([f"it would need {len(grounder.done)} actions, {MOST_ACTIONS} at most"])
    resolver = grounder.resolver
    texts = (plan.reasoning, reasoning(resolver.referents.decisions))
    update = {
        "actions": in_turn(tuple(grounder.done)),
        "reasoning": "; ".join(text for text in texts if text),
    }
    return Grounded(
        plan=plan.model_copy(update=update),
        decisions=tuple(resolver.referents.decisions),
        mentions=tuple(resolver.setting.mentions),
        inserted=frozenset(grounder.inserted),
        certainty=resolver.referents.certainty,
    )


class _Grounder:
    """Ground one action after another, keeping the state that those before it leave."""

    def __init__(self, request: Request) -> None:
        self.resolver = Resolver(request)
        self.done: list[Action] = []
        self.inserted: set[str] = set()
        self._request = request
        self._state = state_of(request.world, request.scene, request.here)
        self._last: dict[str, tuple[str, ...]] = {}
        self._taken: set[str] = set()
        self._judged = 0

    def add(self, action: Action) -> None:
        """Ground an action, with what must come before it, into none, one or several."""
        action = normalised(action, self._request.world.poses)
        needed = tuple(
            dict.fromkeys(name for one in action.depends_on for name in self._last.get(one, (one,)))
        )
        for skill, parameters in grounded_steps(action, self.resolver, lambda: self._state):
            own = skill == action.skill
            step = _made(action, skill, parameters)
            if own:
                step = action.model_copy(update={"parameters": dict(parameters)})
            step = self._with_hand(self._as_sure(step))
            needed = self._append(step, self._prepared(step, needed), inserted=not own)
        self._last[action.id] = needed

    def _with_hand(self, step: Action) -> Action:
        """Name the hands when a second thing is taken: who puts down must know which is where."""
        held = self._state.held
        if step.skill != "pick_up" or len(held) != 1 or len(self._state.hands) < 2:
            return step
        arm = held[0].hand
        if not arm:
            arm = next(one for one in self._state.hands if one != step.parameters.get("arm"))
            self._name_hand(arm)
        other = next(one for one in self._state.hands if one != arm)
        arm = step.parameters.get("arm", other)
        return step.model_copy(update={"parameters": {**step.parameters, "arm": arm}})

    def _name_hand(self, arm: str) -> None:
        """Let the latest thing taken be in that hand."""
        at = max(n for n, one in enumerate(self.done) if one.skill == "pick_up")
        taken = self.done[at]
        parameters = {**taken.parameters, "arm": arm}
        self.done[at] = taken.model_copy(update={"parameters": parameters})
        held = tuple(replace(one, hand=arm) for one in self._state.held)
        self._state = replace(self._state, held=held)

    def _as_sure(self, step: Action) -> Action:
        """Let a step be as feasible as its words, read since the step before, are sure."""
        fresh = self.resolver.referents.decisions[self._judged :]
        self._judged = len(self.resolver.referents.decisions)
        sure = min((one.certainty for one in fresh), default=1.0)
        return step.model_copy(update={"feasibility_score": min(step.feasibility_score, sure)})

    def _prepared(self, step: Action, needed: tuple[str, ...]) -> tuple[str, ...]:
        """Put in what must come before a step; return what the step then needs."""
        for _ in range(MOST_INSERTED):
            missing = missing_before(step, self._state, self._request)
            if missing is None:
                break
            needed = self._append(_made(step, *missing), needed, inserted=True)
        return needed

    def _append(
        self, action: Action, needed: tuple[str, ...], inserted: bool = False
    ) -> tuple[str, ...]:
        """Add an action behind those that it needs; return what comes next needs."""
        if self._is_needless(action):
            return needed
        name = free_id(action.id, self._taken)
        self._taken.add(name)
        action = _completed(action.model_copy(update={"id": name, "depends_on": needed}))
        self.done.append(action)
        if inserted:
            self.inserted.add(name)
        if action.skill in LOGIC and not action_faults(action, self._request.world):
            self._state = after(action, self._state, self._request.world, self._request.scene)
        return (name,)

    def _is_needless(self, action: Action) -> bool:
        """Tell whether the action before it has just done the same."""
        if action.skill not in IDEMPOTENT or not self.done:
            return False
        before = self.done[-1]
        return (before.skill, before.parameters) == (action.skill, action.parameters)


def _made(action: Action, skill: str, parameters: Parameters) -> Action:
    """Return an action that is put in before another, of the same priority."""
    name = f"{action.id[:40]}_{skill}"
    return Action(
        id=name,
        skill=skill,
        parameters=dict(parameters),
        priority=action.priority,
        description=PUT_IN,
    )


def _completed(action: Action) -> Action:
    """Fill in from the tables what the author of an action left out."""
    spec, logic = SKILLS.get(action.skill), LOGIC.get(action.skill)
    if spec is None or logic is None:
        return action
    return action.model_copy(
        update={
            "resources": spec.resources,
            "preconditions": action.preconditions or tuple(logic.needs),
            "effects": action.effects or logic.leaves,
            "estimated_duration_s": action.estimated_duration_s or spec.estimated_duration_s,
        }
    )
