"""Tell, before anything is written, which programs of the system cannot do their work here."""

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

from vla_deploy.install.commands import Command
from vla_deploy.install.errors import ToolMissing

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
