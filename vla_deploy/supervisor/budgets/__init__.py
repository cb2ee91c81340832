"""Hold the robot to its budgets: measure, judge, take the ladder's steps, undo them."""

from vla_deploy.supervisor.budgets.keeper import BudgetKeeper, Orders
from vla_deploy.supervisor.budgets.opening import open_keeper
from vla_deploy.supervisor.budgets.sampler import BackgroundSampler, SnapshotFeed, UsageSnapshot

__all__ = [
    "BackgroundSampler",
    "BudgetKeeper",
    "Orders",
    "SnapshotFeed",
    "UsageSnapshot",
    "open_keeper",
]
