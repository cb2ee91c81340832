"""Run the robot's processes: start, watch, restart and stop them in order."""

from vla_deploy.supervisor.errors import (
    AlreadyRunning,
    RuntimeUnavailable,
    StartFailed,
    SupervisorError,
)
from vla_deploy.supervisor.options import RunOptions
from vla_deploy.supervisor.runtime import Owner, default_base, running
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import TABLE, ProcessSpec, RestartPolicy

__all__ = [
    "TABLE",
    "AlreadyRunning",
    "Owner",
    "ProcessSpec",
    "RestartPolicy",
    "RunOptions",
    "RuntimeUnavailable",
    "StartFailed",
    "Supervisor",
    "SupervisorError",
    "default_base",
    "running",
]
