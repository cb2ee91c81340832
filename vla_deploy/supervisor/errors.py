"""Group what the supervisor refuses to do.

SupervisorError
├── AlreadyRunning      another supervisor holds the runtime directory: stop it or choose another
├── RuntimeUnavailable  the runtime directory cannot be used: fix its path or permissions
├── ProcessGivenUp      the robot cannot go on without that process: the run ends
└── StartFailed         a process did not become ready: its last words are in the message
    ├── StartCrashed    it crashed or hung on its way: another try may help
    └── DeviceAbsent    a device it needs is not there, or silent: plug it in, switch it on
"""


class SupervisorError(Exception):
    """Base of everything the supervisor raises."""


class AlreadyRunning(SupervisorError):
    """Say who holds the runtime directory."""


class RuntimeUnavailable(SupervisorError):
    """Say why the runtime directory cannot be used."""


class StartFailed(SupervisorError):
    """Say which process did not become ready, and why."""


class StartCrashed(StartFailed):
    """Say which process crashed or hung before it was ready: no fault of file or wiring."""


class DeviceAbsent(StartFailed):
    """Say which process did not find its device in several tries, and which device that is."""


class ProcessGivenUp(SupervisorError):
    """Say which process the robot cannot do without was given up, and why."""
