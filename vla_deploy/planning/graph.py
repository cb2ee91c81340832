"""Order actions by their dependencies and name what stands in the way."""

from collections.abc import Sequence

from vla_deploy.planning.plan import Action, Priority

_RANK = {Priority.HIGH: 0, Priority.MEDIUM: 1, Priority.LOW: 2}


def dependency_faults(actions: Sequence[Action]) -> list[str]:
    """Return every duplicate id, unknown dependency and cycle."""
    ids = [action.id for action in actions]
    faults = [f'action id "{name}" is used twice' for name in sorted(_repeated(ids))]
    faults += [
        f'action "{action.id}" depends on "{needed}", which is not in the plan'
        for action in actions
        for needed in action.depends_on
        if needed not in ids
    ]
    cycle = find_cycle(actions)
    if cycle:
        faults.append("the dependencies form a cycle: " + " -> ".join(cycle))
    return faults


def find_cycle(actions: Sequence[Action]) -> list[str]:
    """Return one cycle as ids, first one repeated at the end, or an empty list."""
    needs = {action.id: action.depends_on for action in actions}
    done: set[str] = set()
    for start in needs:
        trail: list[str] = []
        pending = [(start, iter(needs[start]))]
        trail.append(start)
        while pending:
            name, rest = pending[-1]
            following = next((n for n in rest if n in needs and n not in done), None)
            if following is None:
                done.add(name)
                pending.pop()
                trail.pop()
            elif following in trail:
                return [*trail[trail.index(following) :], following]
            else:
                trail.append(following)
                pending.append((following, iter(needs[following])))
    return []


def execution_order(actions: Sequence[Action]) -> list[Action]:
    """Return actions so that dependencies come first, then priority, then the order given.

    Raises:
        ValueError: the dependencies are not a directed acyclic graph; check them first.
    """
    waiting = list(actions)
    finished: set[str] = set()
    ordered: list[Action] = []
    while waiting:
        ready = [action for action in waiting if finished.issuperset(action.depends_on)]
        if not ready:
            raise ValueError("; ".join(dependency_faults(actions)))
        chosen = min(ready, key=lambda action: _RANK[action.priority])
        waiting.remove(chosen)
        finished.add(chosen.id)
        ordered.append(chosen)
    return ordered


def _repeated(names: Sequence[str]) -> set[str]:
    return {name for name in names if names.count(name) > 1}
