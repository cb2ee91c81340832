"""Name the programs of the system that make it take note of what was written, and run them."""

import shlex
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

from vla_deploy.install.errors import SystemCommandFailed
from vla_deploy.install.files import InstalledFile
from vla_deploy.install.layout import RELEASE_FILES, SERVICE, STATE_FOLDERS, InstallLayout

Command = tuple[str, ...]
_TIMEOUT_S = 120.0
_RELOAD: tuple[Command, ...] = (
    ("udevadm", "control", "--reload"),
    ("systemctl", "daemon-reload"),
)


def after_install(files: Iterable[InstalledFile]) -> tuple[Command, ...]:
    """Return what makes the system know user, folders, devices and units."""
    units = [file.path.name for file in files if "WantedBy=" in file.text]
    return (
        ("systemd-sysusers", "vla-deploy.conf"),
        ("systemd-tmpfiles", "--create", "vla-deploy.conf"),
        *_RELOAD,
        ("udevadm", "trigger", "--subsystem-match=tty", "--subsystem-match=usb-serial"),
        ("systemctl", "enable", *units),
    )


def before_uninstall(paths: Iterable[Path]) -> tuple[Command, ...]:
    """Return what stops the robot in order and keeps it from starting again."""
    names = [path.name for path in paths if path.suffix in (".service", ".socket")]
    units = [name for name in names if name != SERVICE and "@" not in name]
    return (("systemctl", "disable", "--now", SERVICE, *units),)


def after_uninstall(layout: InstallLayout, *, purge: bool) -> tuple[Command, ...]:
    """Return what makes the system forget; with `purge` also state, releases and user.

    Of the prefix only what is known to be ours goes: others may keep files there.
    """
    if not purge:
        return _RELOAD
    ours = (*STATE_FOLDERS, *(layout.prefix / name for name in RELEASE_FILES))
    paths = [str(layout.on_disk(path)) for path in ours]
    remove: Command = ("rm", "-rf", "--one-file-system", "--", *paths)
    return (*_RELOAD, remove, ("userdel", layout.user)) if layout.is_this_computer else (remove,)


def run_command(command: Sequence[str]) -> str:
    """Run one command and return what it printed.

    Raises:
        SystemCommandFailed: it is missing, failed or took too long.
    """
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SystemCommandFailed(f"`{shlex.join(command)}` did not run: {error}") from error
    if done.returncode:
        words = (done.stderr or done.stdout).strip() or "nothing said"
        raise SystemCommandFailed(f"`{shlex.join(command)}` ended with {done.returncode}: {words}")
    return done.stdout
