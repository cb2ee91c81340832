"""Hold the robot to its budgets: measure, judge, take the ladder's steps, undo them."""

from vla_deploy.supervisor.budgets.keeper import BudgetKeeper, open_keeper
from vla_deploy.supervisor.budgets.sampler import BackgroundSampler, UsageSnapshot

__all__ = ["BackgroundSampler", "BudgetKeeper", "UsageSnapshot", "open_keeper"]
