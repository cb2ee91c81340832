"""`vla-deploy install` and `uninstall`: install the service on this computer, or remove it."""

import argparse
import difflib
import os
import shlex
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from platforms import load_profile
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.install import (
    ChangeKind,
    Credential,
    FileChange,
    InstallLayout,
    ServiceChoice,
    install_changes,
    system_files,
    uninstall_changes,
)
from vla_deploy.install.changes import (
    afterwards,
    apply_changes,
    during,
    paths_of,
    read_files,
    read_manifest,
    write_manifest,
)
from vla_deploy.install.commands import (
    Command,
    after_install,
    after_uninstall,
    before_uninstall,
    missing_tools,
    require_tools,
    run_command,
)
from vla_deploy.install.disk import readable_by_all, remove_if_empty
from vla_deploy.install.files import service_profile
from vla_deploy.install.layout import DEFAULT_PREFIX
from vla_deploy.robots import load_robot

INSTALL_EXAMPLES = """  vla-deploy install --robot butler --dry-run
  sudo vla-deploy install --robot butler --profile jetson_orin_nx
  vla-deploy install --root /tmp/image        into a folder that stands for the computer
"""
UNINSTALL_EXAMPLES = """  vla-deploy uninstall --dry-run
  sudo vla-deploy uninstall                   logs, state and releases stay
  sudo vla-deploy uninstall --purge           they go, too
"""


def register(commands: Any) -> None:
    """Add the commands."""
    install = add_top_command(commands, "install", INSTALL_EXAMPLES, run_install)
    add_layout_arguments(install)
    install.add_argument("--robot", default="butler", help="name or folder (default: butler)")
    install.add_argument(
        "--profile",
        default="",
        help="fix the platform profile (default: the chosen or detected one, at each start)",
    )
    install.add_argument("--twin", action="store_true", help="run the twin, not the hardware")
    install.add_argument(
        "--credential",
        type=_credential,
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="give the service a secret from a file that only root can read",
    )
    uninstall = add_top_command(commands, "uninstall", UNINSTALL_EXAMPLES, run_uninstall)
    add_layout_arguments(uninstall)
    uninstall.add_argument(
        "--purge", action="store_true", help="remove state, logs, releases and the user, too"
    )


def add_layout_arguments(command: argparse.ArgumentParser) -> None:
    """Add the arguments that say where files are and how to report."""
    command.add_argument("--root", type=Path, default=Path("/"), help="a folder to install into")
    command.add_argument("--prefix", type=Path, default=DEFAULT_PREFIX, help="of releases")
    command.add_argument(
        "--dry-run", action="store_true", help="say what would be done, do nothing"
    )
    command.add_argument("--json", action="store_true", help="print what is done as JSON")


def layout_of(arguments: argparse.Namespace) -> InstallLayout:
    """Return the layout that the arguments ask for.

    Raises:
        UsageError: a path is not absolute, or this computer may only be changed by root.
    """
    if not arguments.prefix.is_absolute():
        raise UsageError(f"--prefix {arguments.prefix}: expected an absolute path")
    layout = InstallLayout(root=arguments.root.absolute(), prefix=arguments.prefix)
    if layout.is_this_computer and not arguments.dry_run and os.geteuid() != 0:
        raise UsageError(
            f"{arguments.command} changes this computer, which only root may: use sudo; "
            "look first with --dry-run, or write into a folder with --root DIR"
        )
    return layout


def run_install(arguments: argparse.Namespace) -> int:
    """Write what is missing or out of date."""
    layout = layout_of(arguments)
    choice = ServiceChoice(
        robot=arguments.robot,
        profile=arguments.profile,
        twin=arguments.twin,
        credentials=tuple(arguments.credential),
    )
    start = service_profile(choice.profile, layout)
    if start.fault:
        _warn(start.fault)
    files = system_files(load_robot(choice.robot), load_profile(start.name), choice, layout)
    known = read_manifest(layout)
    changes = install_changes(files, known, read_files(layout, paths_of(files, known)))
    commands = after_install(files) if layout.is_this_computer else ()
    if not arguments.dry_run:
        require_tools(commands)
    _report(arguments, changes, commands)
    if not arguments.dry_run:
        with readable_by_all():
            write_manifest(layout, during(known, changes), choice)
            apply_changes(layout, changes)
            write_manifest(layout, afterwards(known, changes), choice)
        _run(commands)
    return 0


def run_uninstall(arguments: argparse.Namespace) -> int:
    """Remove the files that install wrote, unless they were edited since."""
    layout = layout_of(arguments)
    if arguments.purge:
        _require_installation(layout)
    known = read_manifest(layout)
    changes = uninstall_changes(known, read_files(layout, known))
    before = before_uninstall(known) if known and layout.is_this_computer else ()
    after = after_uninstall(layout, purge=arguments.purge)
    after = after if layout.is_this_computer or arguments.purge else ()
    faults = missing_tools((*before, *after))
    before, after = _runnable(before, faults), _runnable(after, faults)
    _report(arguments, changes, (*before, *after))
    if not arguments.dry_run:
        _run(before)
        apply_changes(layout, changes)
        write_manifest(layout, {})
        _run(after)
        remove_if_empty(layout.on_disk(layout.prefix))
    return 0


def _require_installation(layout: InstallLayout) -> None:
    """Refuse to purge a folder that a mistyped prefix names.

    Raises:
        UsageError: it is no installation.
    """
    prefix = layout.on_disk(layout.prefix)
    is_gone = layout.prefix == DEFAULT_PREFIX and not prefix.exists()
    if not layout.is_installation and not is_gone:
        raise UsageError(
            f"--prefix {layout.prefix}: expected an installation, found neither "
            f"{prefix / 'manifest.json'} nor a release; nothing was removed"
        )


def _credential(text: str) -> Credential:
    name, found, path = text.partition("=")
    if not found or not Path(path).is_absolute():
        raise argparse.ArgumentTypeError(f"expected NAME=/path/of/file, got {text!r}")
    return Credential(name=name, path=Path(path))


def _runnable(commands: Iterable[Command], faults: Mapping[str, str]) -> tuple[Command, ...]:
    """Return the commands whose program can run; warn of each other one."""
    commands = tuple(commands)
    for command in commands:
        if command[0] in faults:
            _warn(f"skipped: {shlex.join(command)}: {faults[command[0]]}")
    return tuple(command for command in commands if command[0] not in faults)


def _warn(text: str) -> None:
    print(f"vla-deploy: {text}", file=sys.stderr)


def _run(commands: Iterable[Command]) -> None:
    for command in commands:
        run_command(command)


def _report(
    arguments: argparse.Namespace, changes: tuple[FileChange, ...], commands: tuple[Command, ...]
) -> None:
    files = [{"path": str(change.path), "change": change.kind.value} for change in changes]
    document = {"files": files, "commands": [list(line) for line in commands]}
    text = ""
    for change in changes:
        text += f"{change.kind.value}: {change.path}\n"
        if arguments.dry_run and change.kind not in (
            ChangeKind.SAME,
            ChangeKind.FORGET,
            ChangeKind.KEEP,
        ):
            text += "".join(_diff(change))
    text += "".join(f"run: {shlex.join(command)}\n" for command in commands)
    text += "nothing was changed: this was a dry run\n" if arguments.dry_run else ""
    emit(arguments, document, text.removesuffix("\n"))


def _diff(change: FileChange) -> Iterable[str]:
    return difflib.unified_diff(
        (change.before or "").splitlines(keepends=True),
        (change.after or "").splitlines(keepends=True),
        "/dev/null" if change.before is None else f"a{change.path}",
        "/dev/null" if change.after is None else f"b{change.path}",
    )
