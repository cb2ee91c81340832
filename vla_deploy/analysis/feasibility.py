"""Judge whether a goal in words can be reached, by planning it with patterns and going through it.

One action of a plan is judged in the same way, without the planning.
"""

from typing import Final

from vla_deploy.analysis.abilities import Abilities
from vla_deploy.analysis.document import Feasible, Task
from vla_deploy.analysis.outlook import MOST_ALTERNATIVES, CannotBe, Outlook
from vla_deploy.analysis.question import Question
from vla_deploy.analysis.steps import judge_step
from vla_deploy.planning.errors import NotUnderstood, PlanningError
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.patterns.backend import plan_command
from vla_deploy.planning.plan import Action, Plan

_DIGITS: Final = 3


def judge_goal(question: Question, abilities: Abilities) -> Task:
    """Return the verdict on the question's goal."""
    outlook = _outlook(question, abilities)
    try:
        plan = _plan(question, abilities, outlook)
    except NotUnderstood as error:
        return _task(question, outlook, Feasible.UNKNOWN, 0.0, str(error))
    except PlanningError as error:
        return _task(question, outlook, Feasible.NO, 1.0, str(error))
    try:
        for action in plan.actions:
            judge_step(action.skill, action.parameters, outlook)
    except CannotBe as found:
        return _task(question, outlook, Feasible.NO, found.belief, str(found))
    return _summed_up(question, outlook, len(plan.actions))


def judge_action(action: Action, question: Question, abilities: Abilities) -> Task:
    """Return the verdict on one action of a plan, from how the world is now."""
    outlook = _outlook(question, abilities)
    try:
        judge_step(action.skill, action.parameters, outlook)
    except CannotBe as found:
        return _task(question, outlook, Feasible.NO, found.belief, str(found))
    return _summed_up(question, outlook, 1)


def _summed_up(question: Question, outlook: Outlook, steps: int) -> Task:
    if outlook.unseen:
        unseen = " and ".join(f"the {one}" for one in outlook.unseen)
        reason = f"{unseen} must be found first; what comes after cannot be judged"
        return _task(question, outlook, Feasible.UNKNOWN, 0.0, reason)
    if outlook.prerequisites:
        reason = "something must be done before"
        return _task(question, outlook, Feasible.AFTER_PREREQUISITES, outlook.belief, reason)
    reason = f"{steps} steps, and nothing in their way"
    return _task(question, outlook, Feasible.YES, outlook.belief, reason)


def _plan(question: Question, abilities: Abilities, outlook: Outlook) -> Plan:
    robot = question.world.robot
    here = None if robot is None else (robot.x_m, robot.y_m, robot.yaw_rad)
    world = World(places=abilities.spoken, poses=abilities.poses, holding=outlook.holding)
    return plan_command(question.goal, world, here)


def _outlook(question: Question, abilities: Abilities) -> Outlook:
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


def _task(
    question: Question, outlook: Outlook, feasible: Feasible, belief: float, reason: str
) -> Task:
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
