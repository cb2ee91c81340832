"""Run the robot's processes: start, watch, restart and stop them in order."""

from vla_deploy.supervisor.errors import (
    AlreadyRunning,
    ProcessGivenUp,
    RuntimeUnavailable,
    StartCrashed,
    StartFailed,
    SupervisorError,
)
from vla_deploy.supervisor.options import RunOptions
from vla_deploy.supervisor.runtime import Owner, default_base, running
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec, RestartPolicy, Watched

__all__ = [
    "TABLE",
    "AlreadyRunning",
    "GivingUp",
    "Owner",
    "ProcessGivenUp",
    "ProcessSpec",
    "RestartPolicy",
    "RunOptions",
    "RuntimeUnavailable",
    "StartCrashed",
    "StartFailed",
    "Supervisor",
    "SupervisorError",
    "Watched",
    "default_base",
    "running",
]
