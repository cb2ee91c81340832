"""Map errors to exit codes.

CommandFailed   the robot tried and did not succeed: exit code 1
UsageError      the request cannot be carried out as it is: exit code 2
"""

import sys
from collections.abc import Mapping
from typing import Final


class UsageError(Exception):
    """Say in one line what is wrong with the request, and what to try."""


class CommandFailed(Exception):
    """Say in one line why the robot did not succeed."""


# What a person can mend: reported in one line without a traceback, exit code 2.
USER_ERRORS: Final[Mapping[str, str]] = {
    "vla_deploy.cli.errors": "UsageError",
    "drivers.errors": "DriverError",
    "vla_deploy.client.access.errors": "AccessError",
    "vla_deploy.gateways.mcp.errors": "AgentGatewayError",
    "vla_deploy.gateways.ros.errors": "RosGatewayError",
    "vla_deploy.install.errors": "InstallError",
    "vla_deploy.inference.errors": "InferenceError",
    "vla_deploy.ipc.errors": "IpcError",
    "vla_deploy.memory.errors": "RecollectionError",
    "vla_deploy.model_servers.errors": "ModelServerError",
    "vla_deploy.navigation.errors": "NavigationError",
    "vla_deploy.perception.camera_tools.errors": "CalibrationError",
    "vla_deploy.plans.errors": "PlanError",
    "platforms.errors": "ProfileError",
    "vla_deploy.robots.errors": "RobotError",
    "vla_deploy.speech.errors": "SpeechError",
    "vla_deploy.supervisor.errors": "SupervisorError",
    "vla_deploy.teleoperation.errors": "TeleoperationError",
    "vla_deploy.telemetry.errors": "TelemetryError",
    "vla_deploy.world.errors": "WorldError",
}


def user_errors() -> tuple[type[Exception], ...]:
    """Return those user errors that can have been raised: those whose modules are loaded."""
    return tuple(
        getattr(sys.modules[module], name)
        for module, name in USER_ERRORS.items()
        if module in sys.modules
    )
