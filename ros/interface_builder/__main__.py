"""Build interface packages for the environment of the interpreter that runs this."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from interface_builder.definitions import read_package
from interface_builder.errors import InterfaceBuildError
from interface_builder.store import build_packages, use_build


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, or find what was built from the same sources; return the exit code."""
    parser = argparse.ArgumentParser(prog="interface_builder", description=__doc__)
    parser.add_argument("packages", nargs="+", type=Path, help="folders of interface packages")
    parser.add_argument("--into", type=Path, required=True, help="folder for what is built")
    parser.add_argument("--path-file", type=Path, help="a .pth file to name the result in")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="compilers at a time")
    given = parser.parse_args(arguments)
    began_s = time.monotonic()
    try:
        packages = [read_package(folder.resolve()) for folder in given.packages]
        build = build_packages(packages, given.into.resolve(), given.jobs)
        if given.path_file is not None:
            use_build(build, given.path_file)
    except InterfaceBuildError as error:
        sys.stderr.write(f"interface_builder: {error}\n")
        return 1
    names = ", ".join(package.name for package in packages)
    how = f"built in {time.monotonic() - began_s:.0f} s" if build.is_new else "up to date"
    sys.stdout.write(f"{names}: {how}: {build.folder}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
