"""Go through a plan symbol by symbol and name every action that could not be done."""

from collections.abc import Sequence

from vla_deploy.planning.catalogue import ARMS, SKILLS
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Action, execution_order
from vla_deploy.planning.symbolic.conditions import Setting
from vla_deploy.planning.symbolic.state import Pose, State, state_of
from vla_deploy.planning.symbolic.table import LOGIC
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
) -> State:
    """Return what would hold after the plan."""
    state = state_of(world, scene, here)
    for action in execution_order(actions):
        state = after(action, state, world, scene)
    return state


def after(action: Action, state: State, world: World, scene: Snapshot | None) -> State:
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


def sharing_faults(actions: Sequence[Action]) -> list[str]:
    """Return which unordered actions share what."""
    return [
        f'actions "{one.id}" and "{other.id}" need the {", ".join(sorted(shared))} at a time; let '
        f'"{other.id}" depend on "{one.id}"'
        for one, other, shared in _conflicts(execution_order(actions))
    ]


def in_turn(actions: Sequence[Action]) -> tuple[Action, ...]:
    """Return the actions in the order of execution, those that share a part one after another."""
    ordered = execution_order(actions)
    added: dict[str, tuple[str, ...]] = {}
    for one, other, _ in _conflicts(ordered):
        added[other.id] = (*added.get(other.id, ()), one.id)
    return tuple(
        action.model_copy(update={"depends_on": (*action.depends_on, *added[action.id])})
        if action.id in added
        else action
        for action in ordered
    )


def _conflicts(ordered: Sequence[Action]) -> list[tuple[Action, Action, frozenset[str]]]:
    """Return pairs that neither comes before the other and that share a part, the next ones only.

    What an added dependency orders indirectly is ordered, too.
    """
    before: dict[str, set[str]] = {}
    found = []
    for place, other in enumerate(ordered):
        known: set[str] = set()
        for needed in other.depends_on:
            known |= {needed, *before.get(needed, ())}
        for one in reversed(ordered[:place]):
            shared = _parts(one) & _parts(other)
            if shared and one.id not in known:
                found.append((one, other, shared))
                known |= {one.id, *before[one.id]}
        before[other.id] = known
    return found


def _parts(action: Action) -> frozenset[str]:
    spec = SKILLS.get(action.skill)
    resources = () if spec is None else spec.resources
    arm = action.parameters.get("arm")
    parts: set[str] = set()
    for one in resources:
        both = one == "arms" or (one == "arm" and arm is None)
        parts |= {f"{name} arm" for name in (ARMS if both else (str(arm),))} if (
            one in ("arm", "arms")
        ) else {one}  # fmt: skip
    return frozenset(parts)
