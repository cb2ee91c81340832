"""Judge by measurement whether actions can be done, from how the world is now."""

from collections.abc import Sequence
from typing import Final

from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.outlook import MOST_ALTERNATIVES, CannotBe, Outlook
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.steps import judge_step
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.plans.plan import Action

_DIGITS: Final = 3


def judge_action(action: Action, question: SceneQuestion, abilities: Abilities) -> Task:
    """Return the verdict on one action of a plan."""
    return judge_actions((action,), question, outlook_of(question, abilities))


def judge_actions(actions: Sequence[Action], question: SceneQuestion, outlook: Outlook) -> Task:
    """Return the verdict on actions that follow each other."""
    try:
        for action in actions:
            judge_step(action.skill, action.parameters, outlook)
    except CannotBe as found:
        return task_of(question, outlook, Feasible.NO, found.belief, str(found))
    return _summed_up(question, outlook, len(actions))


def _summed_up(question: SceneQuestion, outlook: Outlook, steps: int) -> Task:
    if outlook.unseen:
        unseen = " and ".join(f"the {one}" for one in outlook.unseen)
        reason = f"{unseen} must be found first; what comes after cannot be judged"
        return task_of(question, outlook, Feasible.UNKNOWN, 0.0, reason)
    if outlook.prerequisites:
        reason = "something must be done before"
        return task_of(question, outlook, Feasible.AFTER_PREREQUISITES, outlook.belief, reason)
    reason = f"{steps} steps, and nothing in their way"
    return task_of(question, outlook, Feasible.YES, outlook.belief, reason)


def outlook_of(question: SceneQuestion, abilities: Abilities) -> Outlook:
    """Return what is known before the first step."""
    robot = question.world.robot
    held = next((thing for thing in question.world.things if thing.held_by), None)
    holding = {name: question.holding.get(name) for name in abilities.body.hands}
    if held is not None:
        holding.setdefault(held.held_by, held.kind)
        holding[held.held_by] = holding[held.held_by] or held.kind
    return Outlook(
        question=question,
        abilities=abilities,
        holding=holding,
        held=held,
        at=None if robot is None else (robot.x_m, robot.y_m),
    )


def task_of(
    question: SceneQuestion, outlook: Outlook, feasible: Feasible, belief: float, reason: str
) -> Task:
    """Return the verdict with what the steps have found."""
    alternatives = tuple(dict.fromkeys(outlook.alternatives))[:MOST_ALTERNATIVES]
    return Task(
        goal=question.goal,
        feasible=feasible,
        confidence=round(belief, _DIGITS),
        reason=reason,
        prerequisites=tuple(outlook.prerequisites),
        obstacles=tuple(dict.fromkeys(outlook.obstacles)),
        alternatives=alternatives,
    )
