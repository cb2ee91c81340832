"""Build a release from a wheel: an environment of its own that may be moved as a whole."""

import sys
import zipfile
from dataclasses import dataclass
from email.parser import HeaderParser
from pathlib import Path

from vla_deploy.install.commands import run_command
from vla_deploy.install.disk import write_file
from vla_deploy.install.errors import ReleaseRefused
from vla_deploy.install.release_store import ReleaseStore

# A robot that runs keeps the release that it was started from, whatever `current` says later.
LAUNCHER = """#!/bin/sh
here=$(dirname "$(readlink -f "$0")")
exec "$here/../venv/bin/python" -I -m vla_deploy.cli "$@"
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseSource:
    """Say what a release is made of.

    `wheelhouse` is a folder of wheels to install from without a network. `system_packages` lets it
    see those of the computer, such as TensorRT's. `packages_of` is a folder of packages that it
    shares instead of installing its own.
    """

    wheel: Path
    wheelhouse: Path | None = None
    system_packages: bool = False
    packages_of: Path | None = None


def version_of(wheel: Path) -> str:
    """Return the version that a wheel declares.

    Raises:
        ReleaseRefused: it is no wheel of vla-deploy.
    """
    try:
        with zipfile.ZipFile(wheel) as archive:
            names = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
            header = HeaderParser().parsestr(archive.read(names[0]).decode())
    except (OSError, zipfile.BadZipFile, IndexError) as error:
        raise ReleaseRefused(
            f"{wheel} is no wheel ({error}); build one: pip wheel --no-deps ."
        ) from error
    if header["Name"] != "vla-deploy":
        raise ReleaseRefused(f"{wheel} is a wheel of {header['Name']}, expected vla-deploy")
    return str(header["Version"])


def add_release(store: ReleaseStore, release_id: str, source: ReleaseSource) -> Path:
    """Build a release beside the others; it has its name only once it is complete.

    Raises:
        ReleaseRefused: the id is taken or no name.
        SystemCommandFailed: the environment cannot be made.
    """
    folder = store.incoming(release_id)
    venv = folder / "venv"
    flags = ["--system-site-packages"] if source.system_packages else []
    run_command([sys.executable, "-m", "venv", "--without-pip", *flags, str(venv)])
    python = venv / "bin" / "python"
    if source.packages_of is not None:
        share = f"import site; site.addsitedir({str(source.packages_of)!r})\n"  # with its own .pth
        write_file(_site_packages(venv) / "shared.pth", share, 0o644)
    run_command(_pip_install(python, source))
    write_file(folder / "bin" / "vla-deploy", LAUNCHER, 0o755)
    return store.accept(release_id)


def _pip_install(python: Path, source: ReleaseSource) -> list[str]:
    offline = source.wheelhouse is not None or source.packages_of is not None
    options = ["--no-index"] if offline else []
    options += ["--find-links", str(source.wheelhouse)] if source.wheelhouse else []
    options += ["--no-deps", "--ignore-installed"] if source.packages_of else []
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet"]
    return [
        *pip,
        "--disable-pip-version-check",
        "--no-warn-script-location",
        *options,
        str(source.wheel),
    ]


def _site_packages(venv: Path) -> Path:
    return venv / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
