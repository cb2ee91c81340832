"""Define why the robot's service is not installed or updated.

InstallError
├── TemplateBroken       a template has a placeholder without a value
├── ArgumentRefused      a name or path cannot stand in a unit
├── NotPermitted         writing there needs another user
├── ReleaseRefused       the release cannot be added, used or removed; nothing was changed
│   └── SignatureRefused a trusted key has not signed it, or a key or signature cannot be read
├── ToolMissing          a program of the system is not there, or does not answer; nothing changed
├── SystemCommandFailed  a program of the system did not do what it was asked
└── SwitchFailed         the new release did not prove itself; the one before is back in use
"""


class InstallError(Exception):
    """Say what is wrong, where, and what to try."""


class TemplateBroken(InstallError):
    """Name the placeholder and the template."""


class ArgumentRefused(InstallError):
    """Say which, and what may stand there."""


class NotPermitted(InstallError):
    """Name the user who may, and how to look without that right."""


class ReleaseRefused(InstallError):
    """Say which release, and why not."""


class SignatureRefused(ReleaseRefused):
    """Say which file, what is wrong with key or signature, and how to get a good one."""


class SwitchFailed(InstallError):
    """Say which step failed, and what is in use now."""


class ToolMissing(InstallError):
    """Say which, and what to do instead."""


class SystemCommandFailed(InstallError):
    """Say which command, and what it answered."""
