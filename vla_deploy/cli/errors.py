"""Map what may go wrong to what the shell is told.

CommandFailed   the robot tried and did not succeed: exit code 1
UsageError      the request cannot be carried out as it is: exit code 2
"""

from drivers.errors import DriverError
from platforms.errors import ProfileError
from vla_deploy.install import InstallError
from vla_deploy.ipc import IpcError
from vla_deploy.navigation.errors import NavigationError
from vla_deploy.planning.errors import PlanningError
from vla_deploy.robots import RobotFileError
from vla_deploy.supervisor import SupervisorError
from vla_deploy.telemetry.errors import TelemetryError


class UsageError(Exception):
    """Say in one line what is wrong with the request, and what to try."""


class CommandFailed(Exception):
    """Say in one line why the robot did not succeed."""


# Everything a person can mend: told in one line, exit code 2, no traceback.
USER_ERRORS = (
    UsageError,
    DriverError,
    InstallError,
    IpcError,
    NavigationError,
    PlanningError,
    ProfileError,
    RobotFileError,
    SupervisorError,
    TelemetryError,
)
