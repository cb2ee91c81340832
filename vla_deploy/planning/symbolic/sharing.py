"""Find actions that may run side by side although they need the same part of the robot."""

from collections.abc import Sequence

from vla_deploy.planning.catalogue import ARMS, SKILLS
from vla_deploy.planning.plan import Action, execution_order


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
