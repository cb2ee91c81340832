"""Read what the executor publishes of a plan that failed, and hold what was tried before."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from vla_deploy.plans.plan import Action, FailureCause, Plan, execution_order


@dataclass(frozen=True, slots=True, kw_only=True)
class Setback:
    """Hold which action of a plan failed, why, and which had succeeded by then, in order.

    `left` has, by the ids of the relative motions that had begun, the parameters of what is left of
    them, none where that is not known. `answered_by` is the strategy that was tried then, "" where
    it was a planner.
    """

    action: Action
    error: str
    done: tuple[Action, ...]
    cause: FailureCause = FailureCause.SKILL
    left: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    answered_by: str = ""

    @property
    def is_clear(self) -> bool:
        """Return whether it is known of everything that had begun how much is left."""
        return all(self.left.values())

    @property
    def rest(self) -> Action:
        """Return what is left of the action that failed."""
        return self.rest_of(self.action)

    def rest_of(self, action: Action) -> Action:
        """Return what is left of an action: all of it, unless it is a motion that had begun."""
        parameters = {**action.parameters, **self.left.get(action.id, {})}
        return action.model_copy(update={"parameters": parameters})

    def __str__(self) -> str:
        parts = [f"{_words(self.action)} failed: {self.error}"]
        if not self.is_clear:
            parts.append("nobody knows how much was left of it")
        elif self.left:
            parts.append(f"left of it: {_words(self.rest)}")
        parts += [f"done before: {', '.join(map(_words, self.done))}"] if self.done else []
        parts += [f"then tried: {self.answered_by}"] if self.answered_by else []
        return "; ".join(parts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """Hold a command's plan that is being carried out, and what failed before it.

    A plan that came `given` is not changed. `agreed` is what the person has said yes to.
    """

    plan: Plan
    given: bool = False
    agreed: frozenset[str] = frozenset()
    setbacks: tuple[Setback, ...] = ()

    @property
    def history(self) -> tuple[str, ...]:
        """Return a sentence for each plan that failed, for planners that read."""
        return tuple(map(str, self.setbacks))

    @property
    def failed(self) -> Action:
        """Return what the last setback has left of the action that failed."""
        return self.setbacks[-1].rest

    @property
    def left(self) -> list[Action]:
        """Return what the last setback has left undone, in the order of its dependencies."""
        setback = self.setbacks[-1]
        undone = (one for one in execution_order(self.plan.actions) if one not in setback.done)
        return [setback.rest_of(one) for one in undone]

    def tried(self, strategy: str) -> bool:
        """Return whether a strategy has answered the same action's failure before."""
        failed = self.setbacks[-1].action
        before = (one.rest for one in self.setbacks if one.answered_by == strategy)
        same = (failed.skill, failed.parameters)
        return any((one.skill, one.parameters) == same for one in before)

    def after(self, setback: Setback) -> "Carried":
        """Return it with one setback more."""
        return replace(self, setbacks=(*self.setbacks, setback))

    def going_on(self, plan: Plan, strategy: str) -> "Carried":
        """Return it with the plan that shall mend the last setback."""
        last = replace(self.setbacks[-1], answered_by=strategy)
        return replace(self, plan=plan, setbacks=(*self.setbacks[:-1], last))


def numbered(plan: Plan, number: int) -> Plan:
    """Return a recovery's plan with ids that none of the plans before it has."""
    names = {one.id: f"r{number}_{place}" for place, one in enumerate(plan.actions)}
    actions = tuple(
        one.model_copy(
            update={
                "id": names[one.id],
                "depends_on": tuple(names[it] for it in one.depends_on),
                "after": tuple(names[it] for it in one.after),
            }
        )
        for one in plan.actions
    )
    return plan.model_copy(update={"actions": actions})


def read_setback(event: Mapping[str, Any], plan: Plan) -> Setback | None:
    """Return what failed of that plan; None where the event is about another one."""
    action = next((one for one in plan.actions if one.id == event.get("action_id")), None)
    if action is None:
        return None
    done = frozenset(str(one) for one in event.get("done", ()))
    return Setback(
        action=action,
        error=str(event.get("error") or "no reason told"),
        done=tuple(one for one in execution_order(plan.actions) if one.id in done),
        cause=FailureCause(event.get("cause", FailureCause.SKILL)),
        left=event.get("left", {}),
    )


def _words(action: Action) -> str:
    given = ", ".join(f"{name} {value}" for name, value in action.parameters.items())
    return f"{action.skill}({given})"
