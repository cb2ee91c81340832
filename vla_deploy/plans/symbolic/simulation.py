"""Go through a plan symbol by symbol and name every action that could not be done."""

from collections.abc import Sequence

from vla_deploy.plans.catalogue import ARMS, SKILLS
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import Action, execution_order
from vla_deploy.plans.symbolic.conditions import Setting
from vla_deploy.plans.symbolic.state import Pose, SymbolicState, state_of
from vla_deploy.plans.symbolic.table import LOGIC
from vla_deploy.world import Snapshot


def symbolic_faults(
    actions: Sequence[Action],
    world: World,
    scene: Snapshot | None = None,
    here: Pose | None = None,
) -> list[str]:
    """Return which action breaks which rule by which value, in the order of execution.

    After an action that cannot be done the rest is judged as if it had been. The actions must be
    valid one by one, and their dependencies acyclic.
    """
    faults = []
    state = state_of(world, scene, here)
    for action in execution_order(actions):
        logic = LOGIC[action.skill]
        setting = Setting(parameters=action.parameters, world=world, scene=scene)
        faults += [
            f'action "{action.id}": {action.skill} breaks "{rule}": {why}'
            for rule, holds in logic.needs.items()
            if (why := holds(state, setting))
        ]
        state = logic.effect(state, setting)
    return faults


def end_state(
    actions: Sequence[Action],
    world: World,
    scene: Snapshot | None = None,
    here: Pose | None = None,
) -> SymbolicState:
    """Return what would hold after the plan."""
    state = state_of(world, scene, here)
    for action in execution_order(actions):
        state = after(action, state, world, scene)
    return state


def after(
    action: Action, state: SymbolicState, world: World, scene: Snapshot | None
) -> SymbolicState:
    """Return what holds after one action."""
    setting = Setting(parameters=action.parameters, world=world, scene=scene)
    return LOGIC[action.skill].effect(state, setting)


def bounds_faults(actions: Sequence[Action], world: World) -> list[str]:
    """Return by how much a plan is too long, in actions or in time.

    The actions must be valid one by one.
    """
    bounds, faults = world.bounds, []
    if len(actions) > bounds.max_actions:
        faults.append(f"it has {len(actions)} actions, {bounds.max_actions} at most")
    duration_s = sum(expected_s(action) for action in actions)
    if duration_s > bounds.max_duration_s:
        faults.append(f"it would take {duration_s:.0f} s, {bounds.max_duration_s:g} s at most")
    return faults


def expected_s(action: Action) -> float:
    """Return how long an action is expected to take."""
    if action.skill == "wait":
        return float(action.parameters.get("duration_s", 0.0))
    spec = SKILLS.get(action.skill)
    return max(action.estimated_duration_s, 0.0 if spec is None else spec.estimated_duration_s)


# --- parts of the robot that several actions need -------------------------------------------------


def in_turn(actions: Sequence[Action]) -> tuple[Action, ...]:
    """Return the actions in the order of execution, those that share a part one after another."""
    before: dict[str, set[str]] = {}
    ordered: list[Action] = []
    for action in execution_order(actions):
        known: set[str] = set()
        for needed in action.earlier:
            known |= {needed, *before.get(needed, ())}
        added: list[str] = []
        for one in reversed(ordered):
            if one.id not in known and parts_of(one) & parts_of(action):
                added.append(one.id)
                known |= {one.id, *before[one.id]}
        before[action.id] = known
        ordered.append(action.model_copy(update={"after": (*action.after, *added)}))
    return tuple(ordered)


def parts_of(action: Action) -> frozenset[str]:
    """Return what no two actions use at a time; an arm that is not named may be either."""
    spec, arm = SKILLS.get(action.skill), action.parameters.get("arm")
    arms = {"arms": ARMS, "arm": ARMS if arm is None else (str(arm),)}
    resources = () if spec is None else spec.resources
    return frozenset(part for one in resources for part in arms.get(one, (one,)))
