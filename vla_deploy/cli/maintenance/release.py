"""`vla-deploy release ...`: keep several releases, switch between them, roll back."""

import argparse
import logging
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import psutil

from drivers.clock import MonotonicClock
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.maintenance.install import add_layout_arguments, layout_of
from vla_deploy.cli.maintenance.release_signing import make_key, sign_wheel
from vla_deploy.install.building import ReleaseSource, add_release, examined, refuse_older
from vla_deploy.install.changes import installed_choice
from vla_deploy.install.disk import readable_by_all
from vla_deploy.install.layout import SERVICE_RUNTIME, InstallLayout
from vla_deploy.install.release_keys import RELEASE_KEYS
from vla_deploy.install.release_record import UNSIGNED, ReleaseRecord
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.switch import End, Switch, SwitchPlan, SystemdService, recover
from vla_deploy.supervisor.profiles.profile_choice import start_profile

EXAMPLES = """  vla-deploy release list
  sudo vla-deploy release add vla_deploy-0.2.0-py3-none-any.whl --wheelhouse wheels
  sudo vla-deploy release switch 0.2.0-1a2b3c4d      goes back by itself when it does not stay well
  sudo vla-deploy release rollback                   to the release before
  vla-deploy release keygen --key release.key        writes release.key and release.pub
  vla-deploy release sign vla_deploy-0.2.0-py3-none-any.whl --key release.key
"""
_ID_DIGITS = 8


def register(commands: Any) -> None:
    """Add the command."""
    release = add_top_command(commands, "release", EXAMPLES, run)
    add_layout_arguments(release)
    acts = (*_ACTS, *_SIGNING)
    release.add_argument("act", choices=sorted(acts), metavar="|".join(acts))
    release.add_argument("target", nargs="?", help="a wheel to add or sign; else a release's id")
    release.add_argument("--id", help="of the release to add (default: version and checksum)")
    release.add_argument("--wheelhouse", type=Path, help="a folder of wheels; no network is used")
    release.add_argument(
        "--system-packages", action="store_true", help="give it access to the computer's packages"
    )
    release.add_argument(
        "--share-packages", type=Path, metavar="DIR", help="use that folder's packages, not its own"
    )
    release.add_argument(
        "--unsigned",
        action="store_true",
        help="add a wheel that no trusted key has signed: for developers, shown in every list",
    )
    release.add_argument(
        "--allow-downgrade", action="store_true", help="add a wheel older than what is there"
    )
    release.add_argument("--key", type=Path, metavar="FILE", help="of keygen, sign: the secret key")
    release.add_argument("--robot", help="to check a release with (default: the installed one)")
    release.add_argument("--profile", help="to check it with (default: the one that would run)")
    release.add_argument("--healthy", type=float, default=20.0, metavar="S", help="time on trial")
    release.add_argument("--keep", type=int, default=3, metavar="N", help="releases to keep")


def run(arguments: argparse.Namespace) -> int:
    """Do one act."""
    if arguments.act in _SIGNING:
        return _SIGNING[arguments.act](arguments)
    if arguments.act in _READ_ONLY:
        arguments.dry_run = True  # needs no root
    layout = layout_of(arguments)
    store = ReleaseStore(layout.on_disk(layout.prefix))
    return _ACTS[arguments.act](arguments, store)


def _list(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    marks = {store.previous(): "previous", store.current(): "current"}
    rows = [
        {"id": release, "use": marks.get(release, ""), **_origin(record)}
        for release, record in store.records().items()
    ]
    text = "\n".join(
        f"{row['id']:<32} {row['use']:<8} {_origin_words(row)}".rstrip() for row in rows
    )
    return emit(arguments, rows, text or "no release")


def _origin(record: ReleaseRecord) -> dict[str, str]:
    return {
        "version": record.version,
        "signed_by": record.signed_by,
        "packages": record.packages,
    }


def _origin_words(row: Mapping[str, str]) -> str:
    return f"signed by {row['signed_by']}; packages by {row['packages']}"


def _status(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    trial, current = store.trial(), store.current()
    status = {
        "current": current,
        "signed_by": store.records().get(current, ReleaseRecord()).signed_by if current else "",
        "previous": store.previous(),
        "on_trial": trial.to if trial else "",
        "last_rollback": store.last_rollback(),
    }
    text = "\n".join(f"{name}: {value or '-'}" for name, value in status.items())
    return emit(arguments, status, text)


def _add(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    layout = InstallLayout(root=arguments.root.absolute(), prefix=arguments.prefix)
    keys = None if arguments.unsigned else layout.on_disk(RELEASE_KEYS)
    wheel, signature = examined(Path(_target(arguments, "a wheel")), keys)
    if not arguments.allow_downgrade:
        refuse_older(store, wheel)
    source = ReleaseSource(
        wheel=wheel,
        signature=signature,
        wheelhouse=arguments.wheelhouse,
        system_packages=arguments.system_packages,
        packages_of=arguments.share_packages,
    )
    release_id = arguments.id or f"{wheel.version}-{source.sha256[:_ID_DIGITS]}"
    if arguments.unsigned:
        words = f"vla-deploy: {UNSIGNED}: nobody vouches for {wheel.name}; the release says so"
        print(words, file=sys.stderr)
    if not arguments.dry_run:
        with readable_by_all():
            add_release(store, release_id, source)
    added = {"added": release_id, **_origin(source.record)}
    text = f"added {release_id}, {_origin_words(added)}"
    return emit(arguments, added, text, indent=None)


def _switch(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    return _switch_to(_target(arguments, "the id of a release"), arguments, store)


def _rollback(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    if not store.previous():
        raise UsageError("there is no previous release; see: vla-deploy release list")
    return _switch_to(store.previous(), arguments, store)


def _remove(arguments: argparse.Namespace, store: ReleaseStore) -> int:
    release_id = _target(arguments, "the id of a release")
    store.folder(release_id)
    if not arguments.dry_run:
        store.remove(release_id)
    return emit(arguments, {"removed": release_id}, f"removed {release_id}", indent=None)


def _switch_to(release_id: str, arguments: argparse.Namespace, store: ReleaseStore) -> int:
    choice = installed_choice(
        InstallLayout(root=arguments.root.absolute(), prefix=arguments.prefix)
    )
    profile = arguments.profile or choice.profile or start_profile(SERVICE_RUNTIME).name
    plan = SwitchPlan(
        to=release_id,
        robot=arguments.robot or choice.robot,
        profile=profile,
        healthy_s=arguments.healthy,
        keep=arguments.keep,
    )
    store.folder(release_id)
    if arguments.dry_run:
        text = f"would switch {store.current()} -> {release_id}"
        return emit(arguments, {"to": release_id}, text, indent=None)
    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(message)s")
    undone = recover(store, lambda pid: pid != os.getpid() and psutil.pid_exists(pid))
    if undone:
        logging.getLogger(__name__).warning(undone)
    program = store.prefix / "current/bin/vla-deploy"
    service = SystemdService(program) if arguments.root == Path("/") else None
    report = Switch(store, plan, service, MonotonicClock()).run()
    document = {
        "end": report.end.value,
        "current": report.current,
        "failures": list(report.failures),
    }
    text = f"{report.end.value}; in use: {report.current or 'none'}"
    emit(arguments, document, text, indent=None)
    if report.end is not End.SWITCHED:
        raise CommandFailed("; ".join(report.failures))
    return 0


def _target(arguments: argparse.Namespace, what: str) -> str:
    if not arguments.target:
        raise UsageError(
            f"release {arguments.act}: expected {what}; see: vla-deploy release --help"
        )
    return str(arguments.target)


_READ_ONLY = ("list", "status")
_SIGNING: Mapping[str, Callable[[argparse.Namespace], int]] = {
    "keygen": make_key,
    "sign": sign_wheel,
}
_ACTS: Mapping[str, Callable[[argparse.Namespace, ReleaseStore], int]] = {
    "list": _list,
    "status": _status,
    "add": _add,
    "switch": _switch,
    "rollback": _rollback,
    "remove": _remove,
}
