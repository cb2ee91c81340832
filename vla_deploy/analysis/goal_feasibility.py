"""Judge whether a goal in words can be reached: plan it with patterns, and judge the steps."""

from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.actions import judge_actions, outlook_of, task_of
from vla_deploy.feasibility.outlook import Outlook
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.planning.errors import NotUnderstood
from vla_deploy.planning.patterns.backend import plan_command
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import Plan


def judge_goal(question: SceneQuestion, abilities: Abilities) -> Task:
    """Return the verdict on the question's goal."""
    outlook = outlook_of(question, abilities)
    try:
        plan = _plan(question, abilities, outlook)
    except NotUnderstood as error:
        return task_of(question, outlook, Feasible.UNKNOWN, 0.0, str(error))
    except PlanError as error:
        return task_of(question, outlook, Feasible.NO, 1.0, str(error))
    return judge_actions(plan.actions, question, outlook)


def _plan(question: SceneQuestion, abilities: Abilities, outlook: Outlook) -> Plan:
    robot = question.world.robot
    here = None if robot is None else (robot.x_m, robot.y_m, robot.yaw_rad)
    world = World(places=abilities.spoken, poses=abilities.poses, holding=outlook.holding)
    return plan_command(question.goal, world, here)
