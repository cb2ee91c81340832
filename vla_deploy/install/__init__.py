"""Put the robot's service onto a computer, update it, and take it off again."""

from vla_deploy.install.changes import ChangeKind, FileChange, install_changes, uninstall_changes
from vla_deploy.install.errors import InstallError
from vla_deploy.install.files import Credential, InstalledFile, ServiceChoice, system_files
from vla_deploy.install.layout import InstallLayout

__all__ = [
    "ChangeKind",
    "Credential",
    "FileChange",
    "InstallError",
    "InstallLayout",
    "InstalledFile",
    "ServiceChoice",
    "install_changes",
    "system_files",
    "uninstall_changes",
]
