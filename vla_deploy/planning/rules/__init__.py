"""Plan the common commands by rules: a table of patterns, each with its steps.

This is the planner that is always there: no model, no network, the same answer every time.
"""

from vla_deploy.planning.rules.clauses import is_stop
from vla_deploy.planning.rules.command import plan_command
from vla_deploy.planning.rules.drafting import draft_plan
from vla_deploy.planning.rules.intents import Intent

__all__ = ["Intent", "draft_plan", "is_stop", "plan_command"]
