"""Ground a plan: referring expressions become ids, words or places, what is missing is put in.

One function for every planner: patterns, the command parser, language models, a person's own JSON.
Each may say "pick up it" and leave the way there out; what they say too much is left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.errors import PlanInvalid
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import (
    MOST_ACTIONS,
    PUT_IN,
    Action,
    Plan,
    dependency_faults,
    execution_order,
)
from vla_deploy.planning.symbolic.conditions import MET, Setting, has_free_hand, is_before, is_known
from vla_deploy.planning.symbolic.sharing import in_turn
from vla_deploy.planning.symbolic.simulation import after
from vla_deploy.planning.symbolic.state import State, state_of
from vla_deploy.planning.symbolic.table import LOGIC
from vla_deploy.planning.understanding.furniture import nearest_furniture
from vla_deploy.planning.understanding.normaliser import normalised
from vla_deploy.planning.understanding.referring import Step, grounded_steps
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.planning.validator import action_faults

# A free hand takes two steps, then the thing is looked for and driven to.
MOST_INSERTED: Final = 6
LONGEST_ID: Final = 48
# Doing these a second time at once changes nothing.
IDEMPOTENT: Final = frozenset(
    {"navigate_to", "look_at", "find_object", "open_gripper", "close_gripper", "move_arm", "stop"}
)
# These skills want the robot before the thing, those only want it known.
FROM_CLOSE: Final = frozenset({"pick_up", "place"})
OF_THINGS: Final = frozenset({"navigate_to", "look_at", *FROM_CLOSE})


def ground_plan(plan: Plan, request: Request) -> Plan:
    """Return the plan as it can be validated and carried out; it names only what the robot knows.

    Raises:
        PlanInvalid: its dependencies are no order.
        UnknownObject: an expression names nothing that the robot knows.
        UnknownPlace: a place is not known.
        Ambiguous: only the speaker can tell what is meant.
    """
    actions = _with_unique_ids(plan.actions)
    faults = dependency_faults(actions)
    if faults:
        raise PlanInvalid(faults)
    grounder = _Grounder(request)
    for action in execution_order(actions):
        grounder.add(action)
    if len(grounder.done) > MOST_ACTIONS:
        raise PlanInvalid([f"it would need {len(grounder.done)} actions, {MOST_ACTIONS} at most"])
    texts = (plan.reasoning, *dict.fromkeys(grounder.resolver.reasons))
    update = {
        "actions": in_turn(tuple(grounder.done)),
        "reasoning": "; ".join(text for text in texts if text),
    }
    return plan.model_copy(update=update)


class _Grounder:
    """Ground one action after another, keeping the state that those before it leave."""

    def __init__(self, request: Request) -> None:
        self.resolver = Resolver(request)
        self.done: list[Action] = []
        self._request = request
        self._state = state_of(request.world, request.scene, request.here)
        self._last: dict[str, tuple[str, ...]] = {}
        self._taken: set[str] = set()

    def add(self, action: Action) -> None:
        """Ground an action, with what must come before it, into none, one or several."""
        action = normalised(action, self._request.world.poses)
        needed = tuple(
            dict.fromkeys(name for one in action.depends_on for name in self._last.get(one, (one,)))
        )
        for skill, parameters in grounded_steps(action, self.resolver, lambda: self._state):
            step = _made(action, skill, parameters, "")
            if skill == action.skill:
                step = action.model_copy(update={"parameters": dict(parameters)})
            step = self._with_hand(step)
            for missing in self._missing_before(step):
                needed = self._append(_made(step, *missing), needed)
            needed = self._append(step, needed)
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

    def _missing_before(self, step: Action) -> Iterator[Step]:
        """Yield what must still come before a step; each is done before the next is asked for."""
        for _ in range(MOST_INSERTED):
            missing = _missing(step, self._state, self._request)
            if missing is None:
                return
            yield missing

    def _append(self, action: Action, needed: tuple[str, ...]) -> tuple[str, ...]:
        """Add an action behind those that it needs; return what comes next needs."""
        if self._is_needless(action):
            return needed
        name = _free_id(action.id, self._taken)
        self._taken.add(name)
        action = _completed(action.model_copy(update={"id": name, "depends_on": needed}))
        self.done.append(action)
        if action.skill in LOGIC and not action_faults(action, self._request.world):
            self._state = after(action, self._state, self._request.world, self._request.scene)
        return (name,)

    def _is_needless(self, action: Action) -> bool:
        """Tell whether the action before it has just done the same."""
        if action.skill not in IDEMPOTENT or not self.done:
            return False
        before = self.done[-1]
        return (before.skill, before.parameters) == (action.skill, action.parameters)


def _missing(action: Action, state: State, request: Request) -> Step | None:
    """Return the first step that a plan leaves out before an action: a look, a way, a free hand."""
    if action.skill not in OF_THINGS:
        return None
    setting = Setting(parameters=action.parameters, world=request.world, scene=request.scene)
    if action.skill == "pick_up" and has_free_hand(state, setting):
        return _towards_free_hand(action, state, request.world)
    subject = setting.subject("object") or setting.subject("destination")
    name = action.parameters.get("object", action.parameters.get("destination"))
    if subject is not None and is_known(state, setting) != MET:
        return "find_object", {"object": name}
    if action.skill in FROM_CLOSE and is_before(state, setting) != MET:
        return "navigate_to", {"object" if subject is not None else "place": name}
    return None


def _towards_free_hand(action: Action, state: State, world: World) -> Step | None:
    """Put down what a hand holds, on the nearest furniture; None where there is none."""
    table = nearest_furniture(state.spot, world)
    arm = action.parameters.get("arm")
    held = next((one for one in state.held if arm in (None, one.hand)), None)
    if table is None or held is None:
        return None
    if state.at != table:
        return "navigate_to", {"place": table}
    put = {"destination": table, "relation": "on"}
    return "place", {**put, "arm": held.hand} if held.hand else put


def _made(
    action: Action, skill: str, parameters: Mapping[str, Any], description: str = PUT_IN
) -> Action:
    """Return an action that comes before another, of the same priority."""
    name = f"{action.id[:40]}_{skill}"
    return Action(
        id=name,
        skill=skill,
        parameters=dict(parameters),
        priority=action.priority,
        description=description,
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


def _with_unique_ids(actions: Sequence[Action]) -> tuple[Action, ...]:
    """Give each action an id of its own; who depends on a doubled id means the latest before it."""
    taken: set[str] = set()
    latest: dict[str, str] = {}
    unique = []
    for action in actions:
        depends_on = tuple(latest.get(one, one) for one in action.depends_on)
        name = _free_id(action.id, taken)
        taken.add(name)
        latest[action.id] = name
        unique.append(action.model_copy(update={"id": name, "depends_on": depends_on}))
    return tuple(unique)


def _free_id(wanted: str, taken: set[str]) -> str:
    """Return an id like the wanted one that is not taken."""
    if wanted not in taken:
        return wanted
    number = 2
    while f"{wanted[:LONGEST_ID]}_{number}" in taken:
        number += 1
    return f"{wanted[:LONGEST_ID]}_{number}"
