"""Put the robot's service onto a computer, update it, and take it off again."""

from vla_deploy.install.changes import Change, Kind, install_changes, uninstall_changes
from vla_deploy.install.errors import InstallError
from vla_deploy.install.files import Credential, ServiceChoice, SystemFile, system_files
from vla_deploy.install.layout import Layout

__all__ = [
    "Change",
    "Credential",
    "InstallError",
    "Kind",
    "Layout",
    "ServiceChoice",
    "SystemFile",
    "install_changes",
    "system_files",
    "uninstall_changes",
]
