"""Keep built interface packages by what they were built from, whole or not at all.

    <folder>/<key>/<package>/...   the packages, one key for each set of sources and tools
    <folder>/.lock                 held while one build looks, builds or tidies up
    <folder>/building/             of a build that runs, or was cut off: nothing reads it

A path file in site-packages names the folder of the key in use.
"""

import contextlib
import fcntl
import hashlib
import importlib.metadata
import os
import shutil
import sys
import sysconfig
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from interface_builder.compilation import ObjectFiles, compile_sources, find_toolchain, link
from interface_builder.definitions import InterfacePackage, in_build_order, needed_packages
from interface_builder.generation import GeneratedPackage, generate

_BUILDING: Final = "building"
_LOCK: Final = ".lock"
_KEY_CHARACTERS: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class InterfaceBuild:
    """Say where the packages are, and whether they had to be built."""

    folder: Path
    is_new: bool


def build_packages(packages: Sequence[InterfacePackage], folder: Path, jobs: int) -> InterfaceBuild:
    """Build packages for this interpreter into `folder/<key>`, or find them there.

    Raises:
        InterfaceBuildError: definitions are wrong, a tool is missing, or a compiler refuses.
    """
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / fingerprint(packages)
    with _locked(folder / _LOCK):
        if target.is_dir():
            return InterfaceBuild(folder=target, is_new=False)
        building = folder / _BUILDING
        shutil.rmtree(building, ignore_errors=True)
        try:
            _build(in_build_order(packages), building / "work", building / "out", jobs)
            (building / "out").rename(target)
        finally:
            shutil.rmtree(building, ignore_errors=True)
    return InterfaceBuild(folder=target, is_new=True)


def use_build(build: InterfaceBuild, path_file: Path) -> None:
    """Let the interpreter that reads `path_file` import the packages; remove all other builds.

    The build that was in use until now stays: a process may run that has not loaded all of it.
    """
    folder = build.folder.parent
    with _locked(folder / _LOCK):
        before = path_file.read_text().strip() if path_file.is_file() else ""
        if before != str(build.folder):
            written = path_file.with_name(f"{path_file.name}.{os.getpid()}")
            written.write_text(f"{build.folder}\n")
            written.replace(path_file)
        for other in folder.iterdir():
            if build.is_new and other.is_dir() and str(other) not in (before, str(build.folder)):
                shutil.rmtree(other)


def fingerprint(packages: Sequence[InterfacePackage]) -> str:
    """Return a key of everything that the result depends on."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    definitions = sorted(one.folder / file for one in packages for file in one.files)
    wheels = {
        f"{wheel.name}=={wheel.version}"
        for wheel in importlib.metadata.distributions()
        if wheel.name.startswith(("ros-", "ros_", "numpy"))
    }
    parts = [sys.version, sys.prefix, sysconfig.get_config_var("EXT_SUFFIX") or ""]
    parts += [os.environ.get("CFLAGS", ""), *sorted(wheels)]
    for file in (*sources, *definitions):
        parts += [f"{file.parent.parent.name}/{file.parent.name}/{file.name}", file.read_text()]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:_KEY_CHARACTERS]


def _build(packages: Sequence[InterfacePackage], work: Path, out: Path, jobs: int) -> None:
    """Compile each package while the next is generated; link when all is compiled."""
    prefix = Path(sys.prefix)
    toolchain = find_toolchain(prefix)
    folders = {share.name: share for share in (prefix / "share").iterdir() if share.is_dir()}
    generated: dict[str, GeneratedPackage] = {}
    compiled: dict[str, ObjectFiles] = {}
    pool = ThreadPoolExecutor(jobs)
    try:
        for package in packages:
            needs = tuple(needed_packages(package, folders))
            sources = generate(package, work, prefix / "share", needs, folders)
            compiled[package.name] = compile_sources(sources, generated, toolchain, pool)
            generated[package.name] = sources
            folders[package.name] = sources.root
        for name, sources in generated.items():
            link(sources, compiled[name], out, toolchain)
    finally:
        pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _locked(file: Path) -> Iterator[None]:
    with file.open("w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        yield
