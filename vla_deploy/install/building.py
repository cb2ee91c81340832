"""Build a release from a wheel that was checked: its environment, its launcher, its record."""

import contextlib
import hashlib
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.install.commands import run_command
from vla_deploy.install.disk import write_file
from vla_deploy.install.errors import ReleaseRefused, SignatureRefused
from vla_deploy.install.release_keys import ReleaseSignature, signature_of
from vla_deploy.install.release_record import UNSIGNED, PackagesFrom, ReleaseRecord, newest
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.wheels import CheckedWheel, checked_wheel, wheel_bytes

# A robot that runs keeps the release that it was started from, whatever `current` says later.
LAUNCHER: Final = """#!/bin/sh
here=$(dirname "$(readlink -f "$0")")
exec "$here/../venv/bin/python" -I -m vla_deploy.cli "$@"
"""
LOCK_NAME: Final = "requirements.lock"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseSource:
    """Say what a release is made of; without a `signature` nobody vouches for it.

    `wheelhouse` is a folder of wheels to install from without a network. `system_packages` lets it
    see those of the computer, such as TensorRT's. `packages_of` is a folder of packages that it
    shares instead of installing its own.
    """

    wheel: CheckedWheel
    signature: ReleaseSignature | None = None
    wheelhouse: Path | None = None
    system_packages: bool = False
    packages_of: Path | None = None

    @property
    def sha256(self) -> str:
        """Return the digest of the wheel."""
        return hashlib.sha256(self.wheel.data).hexdigest()

    @property
    def packages(self) -> PackagesFrom:
        """Return by what the packages are chosen that it needs."""
        if self.packages_of is not None:
            return PackagesFrom.SHARED
        return PackagesFrom.HASHES if self.wheel.lock else PackagesFrom.NAMES

    @property
    def record(self) -> ReleaseRecord:
        """Return what is written down about the release."""
        signature = self.signature
        return ReleaseRecord(
            version=str(self.wheel.version),
            sha256=self.sha256,
            signed_by=signature.key_id if signature else UNSIGNED,
            trusted_comment=signature.trusted_comment if signature else "",
            packages=self.packages.value,
        )


def examined(wheel: Path, keys: Path | None) -> tuple[CheckedWheel, ReleaseSignature | None]:
    """Return a wheel's content and its signature by one of `keys`, which is verified first.

    Without a folder of keys nobody is asked: the wheel may be anybody's.

    Raises:
        SignatureRefused: no trusted key has signed it; nothing of it was opened.
        ReleaseRefused: it is no wheel of vla-deploy, or beyond the bounds.
    """
    data = wheel_bytes(wheel)
    signature = None if keys is None else signature_of(wheel, data, keys)
    checked = checked_wheel(wheel, data)
    if signature is not None and signature.version not in ("", str(checked.version)):
        raise SignatureRefused(
            f"{wheel}: signed as version {signature.version}, expected {checked.version} as the "
            "wheel has it; sign it again: vla-deploy release sign WHEEL --key FILE"
        )
    return checked, signature


def refuse_older(store: ReleaseStore, wheel: CheckedWheel) -> None:
    """Refuse a wheel that is older than a release that is there: its signature may be replayed.

    Raises:
        ReleaseRefused: it is older.
    """
    found = newest(store.records())
    if found is not None and wheel.version < found[1]:
        raise ReleaseRefused(
            f"{wheel.name} is older than release {found[0]}; expected {found[1]} or newer, as "
            "an old wheel brings its old faults back; if you want it: --allow-downgrade"
        )


def add_release(store: ReleaseStore, release_id: str, source: ReleaseSource) -> Path:
    """Build a release next to the others; it has its name only once it is complete.

    Raises:
        ReleaseRefused: the id is taken or no name, or a signed wheel has no lock file.
        SystemCommandFailed: the environment cannot be made.
    """
    if source.signature is not None and source.packages is PackagesFrom.NAMES:
        raise ReleaseRefused(
            f"{source.wheel.name}: expected share/vla-deploy/{LOCK_NAME} with hashes in it: else "
            "the signature says nothing of the packages that it needs; build the wheel from a "
            "whole source tree, or share packages: --share-packages DIR"
        )
    with contextlib.ExitStack() as undo:
        folder = store.incoming(release_id)
        undo.callback(shutil.rmtree, folder, ignore_errors=True)
        _build(folder, source)
        undo.pop_all()
    return store.accept(release_id)


def _build(folder: Path, source: ReleaseSource) -> None:
    venv = folder / "venv"
    flags = ["--system-site-packages"] if source.system_packages else []
    run_command([sys.executable, "-m", "venv", "--without-pip", *flags, str(venv)])
    if source.packages_of is not None:
        share = f"import site; site.addsitedir({str(source.packages_of)!r})\n"  # with its own .pth
        write_file(_site_packages(venv) / "shared.pth", share, 0o644)
    wheel = folder / source.wheel.name
    wheel.write_bytes(source.wheel.data)  # what was verified, whatever lies under its name by now
    run_command(_pip_install(venv / "bin" / "python", wheel, source))
    wheel.unlink()
    write_file(folder / "bin" / "vla-deploy", LAUNCHER, 0o755)
    source.record.write(folder)


def _pip_install(python: Path, wheel: Path, source: ReleaseSource) -> list[str]:
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    pip += ["--disable-pip-version-check", "--no-warn-script-location"]
    if source.wheelhouse is not None or source.packages_of is not None:
        pip += ["--no-index"]
    if source.wheelhouse is not None:
        pip += ["--find-links", str(source.wheelhouse)]
    if source.packages is PackagesFrom.SHARED:
        return [*pip, "--no-deps", "--ignore-installed", str(wheel)]
    if source.packages is PackagesFrom.NAMES:
        return [*pip, str(wheel)]
    lock = wheel.with_name(LOCK_NAME)
    pin = f"vla-deploy @ {wheel.as_uri()} --hash=sha256:{source.sha256}"
    write_file(lock, f"{source.wheel.lock}\n{pin}\n", 0o644)
    # Of what the computer has, and what is built from source, no hash would be compared.
    return [*pip, "--require-hashes", "--only-binary=:all:", "--ignore-installed", "-r", str(lock)]


def _site_packages(venv: Path) -> Path:
    return venv / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
