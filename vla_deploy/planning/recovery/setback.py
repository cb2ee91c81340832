"""Read what the executor tells of a plan that failed, and hold what was tried before."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from vla_deploy.planning.plan import Action, Plan, execution_order


class Cause(StrEnum):
    """Say by what an action failed: the skill itself, or the world before or after it."""

    PRECONDITION = "precondition"
    SKILL = "skill"
    EFFECT = "effect"


@dataclass(frozen=True, slots=True, kw_only=True)
class Setback:
    """Hold which action of a plan failed, why, and which had succeeded by then, in order.

    `left` are the relative motions that had begun, with what is left of them; one of which nobody
    knows that has no parameters.
    """

    action: Action
    error: str
    done: tuple[Action, ...]
    cause: Cause = Cause.SKILL
    left: tuple[Action, ...] = ()

    @property
    def done_ids(self) -> frozenset[str]:
        """Return the ids of what had succeeded."""
        return frozenset(one.id for one in self.done)

    @property
    def is_clear(self) -> bool:
        """Tell whether it is known of everything that had begun how much is left."""
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
    `given` is whoever gave it to change. `agreed` is what the person has said yes to.
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
    def left(self) -> tuple[Action, ...]:
        """Return what the last setback has left undone, in order; it needs only each other."""
        setback = self.setbacks[-1]
        done = setback.done_ids
        return tuple(
            setback.rest_of(action).model_copy(
                update={"depends_on": tuple(one for one in action.depends_on if one not in done)}
            )
            for action in execution_order(self.plan.actions)
            if action.id not in done
        )

    def tried(self, strategy: str) -> bool:
        """Tell whether a strategy has answered the same action's failure before."""
        failed = self.setbacks[-1].action
        return any(
            used == strategy and _same(setback.rest_of(setback.action), failed)
            for setback, used in zip(self.setbacks, self.used, strict=False)
        )

    def after(self, setback: Setback) -> "Carried":
        """Return it with one setback more."""
        return replace(self, setbacks=(*self.setbacks, setback))

    def going_on(self, plan: Plan, strategy: str) -> "Carried":
        """Return it with the plan that shall mend the last setback."""
        return replace(self, plan=plan, used=(*self.used, strategy))


def read_setback(told: Mapping[str, Any], plan: Plan) -> Setback | None:
    """Return what failed of that plan; None where the event speaks of another one."""
    action = next((one for one in plan.actions if one.id == told.get("action_id")), None)
    if action is None:
        return None
    done = frozenset(str(one) for one in told.get("done", ()))
    left: Mapping[str, Mapping[str, float]] = told.get("left", {})
    return Setback(
        action=action,
        error=str(told.get("error") or "no reason told"),
        done=tuple(one for one in execution_order(plan.actions) if one.id in done),
        cause=Cause(told.get("cause", Cause.SKILL)),
        left=tuple(_rest(one, left[one.id]) for one in plan.actions if one.id in left),
    )


def _rest(action: Action, left: Mapping[str, float]) -> Action:
    parameters = {**action.parameters, **left} if left else {}
    return action.model_copy(update={"parameters": parameters})


def _words(action: Action) -> str:
    told = ", ".join(f"{name} {value}" for name, value in action.parameters.items())
    return f"{action.skill}({told})"


def _same(one: Action, other: Action) -> bool:
    return (one.skill, one.parameters) == (other.skill, other.parameters)
