"""Put the keeper of one run together."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from drivers.clock import Clock, MonotonicClock
from platforms import Profile
from platforms.probes import ProbeSet, open_probes
from vla_deploy.ipc import ClaimBook, SharedSpace
from vla_deploy.supervisor.budgets.cgroup import CgroupTree
from vla_deploy.supervisor.budgets.emergency import Emergencies, critical_trips_c
from vla_deploy.supervisor.budgets.enforcement import Enforcer
from vla_deploy.supervisor.budgets.keeper import BudgetKeeper
from vla_deploy.supervisor.budgets.sampler import BackgroundSampler


def open_keeper(
    profile: Callable[[], Profile],
    space: SharedSpace,
    clock: Clock,
    *,
    state_dir: Path,
    probe_root: Path,
) -> BudgetKeeper:
    """Begin to measure, and return the keeper of a run's budgets.

    The disk is the one that holds what is kept beyond the run: logs, crash reports, recordings.
    """

    def probes() -> ProbeSet:
        return open_probes(probe_root, disk_folders=[_existing(state_dir)])

    return BudgetKeeper(
        profile,
        space,
        clock,
        BackgroundSampler(probes, clock, MonotonicClock()),
        Emergencies(partial(critical_trips_c, probe_root)),
        Enforcer(CgroupTree(realtime=profile().realtime_priority > 0)),
        ClaimBook(space, clock),
    )


def _existing(folder: Path) -> Path:
    return next(one for one in (folder, *folder.parents) if one.exists())
