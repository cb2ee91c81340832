"""Define why the supervisor does not start or go on.

SupervisorError
├── AlreadyRunning      another supervisor holds the runtime directory: stop it or choose another
├── RuntimeUnavailable  the runtime directory cannot be used: fix its path or permissions
├── RosNotFound         no environment of ROS 2, or none as it was named: install it, or name it
├── ProfileDoesNotFit   no rates and budgets fit this computer: take a smaller model or robot
├── ProcessGivenUp      the robot cannot go on without that process: the run ends
└── StartFailed         a process did not become ready: its last log lines are in the message
    ├── StartCrashed    it crashed or hung on its way: another try may help
    └── DeviceAbsent    a device it needs is not there, or silent: plug it in, switch it on
"""


class SupervisorError(Exception):
    """Base of everything the supervisor raises."""


class AlreadyRunning(SupervisorError):
    """Name the supervisor that holds the runtime directory."""


class RuntimeUnavailable(SupervisorError):
    """Give the reason why the runtime directory cannot be used."""


class RosNotFound(SupervisorError):
    """Name where an environment of ROS 2 was looked for, or why it cannot be used."""


class ProfileDoesNotFit(SupervisorError):
    """Name what the computer lacks for a robot, by how much."""


class StartFailed(SupervisorError):
    """Name the process that did not become ready, and why."""


class StartCrashed(StartFailed):
    """Name the process that crashed or hung before it was ready: no fault of file or wiring."""


class DeviceAbsent(StartFailed):
    """Name the process that did not find its device in several tries, and the device."""


class ProcessGivenUp(SupervisorError):
    """Name the process that was given up and that the robot cannot do without, and why."""
