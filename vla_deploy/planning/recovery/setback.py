"""Read what the executor publishes of a plan that failed, and hold what was tried before."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from vla_deploy.planning.plan import Action, Plan, execution_order


class FailureCause(StrEnum):
    """Say by what an action failed: the skill itself, or the world before or after it."""

    PRECONDITION = "precondition"
    SKILL = "skill"
    EFFECT = "effect"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setback:
    """Hold which action of a plan failed, why, and which had succeeded by then, in order.

    `left` are the relative motions that had begun, with what is left of them; where that is not
    known, without parameters.
    """

    action: Action
    error: str
    done: tuple[Action, ...]
    cause: FailureCause = FailureCause.SKILL
    left: tuple[Action, ...] = ()

    @property
    def is_clear(self) -> bool:
        """Return whether it is known of everything that had begun how much is left."""
        return all(one.parameters for one in self.left)

    def rest_of(self, action: Action) -> Action:
        """Return what is left of an action: all of it, unless it is a motion that had begun."""
        return next((one for one in self.left if one.id == action.id), action)

    def __str__(self) -> str:
        parts = [f"{_words(self.action)} failed: {self.error}"]
        parts += [f"left of it: {_words(one)}" for one in self.left if one.parameters]
        parts += [
            f"nobody knows how much was left of it: {one.skill}"
            for one in self.left
            if not one.parameters
        ]
        parts += [f"done before: {', '.join(map(_words, self.done))}"] if self.done else []
        return "; ".join(parts)


@dataclass(frozen=True, slots=True, kw_only=True)
class Carried:
    """Hold a command's plan that is being carried out, and what failed before it.

    `used` are the strategies that answered each setback, "" where a planner did. A plan that came
    `given` is not changed. `agreed` is what the person has said yes to.
    """

    plan: Plan
    given: bool = False
    agreed: frozenset[str] = frozenset()
    setbacks: tuple[Setback, ...] = ()
    used: tuple[str, ...] = ()

    @property
    def history(self) -> tuple[str, ...]:
        """Return a sentence for each plan that failed, for planners that read."""
        return tuple(
            f"{setback}; then tried: {used}" if used else str(setback)
            for setback, used in zip(self.setbacks, (*self.used, ""), strict=False)
        )

    @property
    def failed(self) -> Action:
        """Return what the last setback has left of the action that failed."""
        setback = self.setbacks[-1]
        return setback.rest_of(setback.action)

    @property
    def left(self) -> list[Action]:
        """Return what the last setback has left undone, in the order of its dependencies."""
        setback = self.setbacks[-1]
        undone = (one for one in execution_order(self.plan.actions) if one not in setback.done)
        return [setback.rest_of(one) for one in undone]

    def tried(self, strategy: str) -> bool:
        """Return whether a strategy has answered the same action's failure before."""
        failed = self.setbacks[-1].action
        return any(
            used == strategy
            and (rest := setback.rest_of(setback.action)).skill == failed.skill
            and rest.parameters == failed.parameters
            for setback, used in zip(self.setbacks, self.used, strict=False)
        )

    def after(self, setback: Setback) -> "Carried":
        """Return it with one setback more."""
        return replace(self, setbacks=(*self.setbacks, setback))

    def going_on(self, plan: Plan, strategy: str) -> "Carried":
        """Return it with the plan that shall mend the last setback."""
        return replace(self, plan=plan, used=(*self.used, strategy))


def numbered(plan: Plan, number: int) -> Plan:
    """Return a recovery's plan with ids that none of the plans before it has."""
    names = {one.id: f"r{number}_{place}" for place, one in enumerate(plan.actions)}
    actions = tuple(
        one.model_copy(
            update={"id": names[one.id], "depends_on": tuple(names[it] for it in one.depends_on)}
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
    left: Mapping[str, Mapping[str, float]] = event.get("left", {})
    return Setback(
        action=action,
        error=str(event.get("error") or "no reason told"),
        done=tuple(one for one in execution_order(plan.actions) if one.id in done),
        cause=FailureCause(event.get("cause", FailureCause.SKILL)),
        left=tuple(_rest(one, left[one.id]) for one in plan.actions if one.id in left),
    )


def _rest(action: Action, left: Mapping[str, float]) -> Action:
    parameters = {**action.parameters, **left} if left else {}
    return action.model_copy(update={"parameters": parameters})


def _words(action: Action) -> str:
    given = ", ".join(f"{name} {value}" for name, value in action.parameters.items())
    return f"{action.skill}({given})"
