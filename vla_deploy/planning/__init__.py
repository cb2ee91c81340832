"""Turn commands and model output into plans that may run."""

from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.dialects import parse_plan
from vla_deploy.planning.errors import PlanInvalid, PlanningError
from vla_deploy.planning.plan import Action, ActionStatus, Plan, plan_schema
from vla_deploy.planning.rules import plan_command
from vla_deploy.planning.validator import World, check_plan

__all__ = [
    "SKILLS",
    "Action",
    "ActionStatus",
    "Plan",
    "PlanInvalid",
    "PlanningError",
    "World",
    "check_plan",
    "parse_plan",
    "plan_command",
    "plan_schema",
]
