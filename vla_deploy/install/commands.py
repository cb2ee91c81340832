"""Name the programs that apply what was written, check that they can run here, and run them."""

import shlex
import shutil
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from vla_deploy.install.errors import SystemCommandFailed, ToolMissing
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
    """Return what makes the system forget the units; `purge` also removes state and releases.

    Only what is known to be ours leaves the prefix: others may keep files there.
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


# Who has to be running for a program to reach it; a container often has the program alone.
_ANSWERS: Final[Mapping[str, Path]] = {
    "systemctl": Path("/run/systemd/system"),
    "udevadm": Path("/run/udev/control"),
}


def missing_tools(
    commands: Iterable[Command], answers: Mapping[str, Path] = _ANSWERS
) -> dict[str, str]:
    """Return what keeps each program from working, by its name; nothing when all can."""
    programs = dict.fromkeys(command[0] for command in commands)
    faults = {program: _fault(program, answers) for program in programs}
    return {program: fault for program, fault in faults.items() if fault}


def require_tools(commands: Iterable[Command]) -> None:
    """Refuse where a program cannot do its work.

    Raises:
        ToolMissing: one cannot; all of them are named.
    """
    faults = missing_tools(commands)
    if faults:
        raise ToolMissing(
            f"this computer cannot run the service: {'; '.join(faults.values())}; nothing was "
            "changed. Use a computer that systemd has booted, or make an image with --root DIR"
        )


def _fault(program: str, answers: Mapping[str, Path]) -> str:
    if shutil.which(program) is None:
        return f"{program} is not on the PATH"
    answer = answers.get(program)
    if answer is not None and not answer.exists():
        return f"{program} reaches nobody, as there is no {answer}"
    return ""
