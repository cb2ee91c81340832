"""Compile and link the generated sources of an interface package.

Three shared objects a package. rmw_fastrtps_cpp asks rosidl_typesupport_c for two type supports,
and that opens `lib<package>__<type support>.so` by its bare name. Both libraries have that name as
SONAME and are NEEDED by the extension module (RUNPATH $ORIGIN), so they are loaded already when
they are asked for: no LD_LIBRARY_PATH.
"""

import os
import shutil
import subprocess
import sysconfig
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from interface_builder.errors import BuildToolMissing, CompilationFailed
from interface_builder.generation import DISPATCHER, FAST, INTROSPECTION, GeneratedPackage

COMPILERS: Mapping[str, tuple[str, ...]] = {
    ".c": ("gcc", "-std=gnu11"),
    ".cpp": ("g++", "-std=c++17"),
}
_FLAGS: Final = ("-O1", "-fPIC", "-w", "-DRCUTILS_ENABLE_FAULT_INJECTION=0")
# What generated sources include whatever their definitions name.
_ALWAYS_INCLUDED: Final = (
    *("rosidl_runtime_c", "rosidl_runtime_cpp", DISPATCHER, "rosidl_typesupport_cpp"),
    *("rosidl_typesupport_interface", FAST, "rosidl_typesupport_fastrtps_cpp", INTROSPECTION),
    *("rosidl_dynamic_typesupport", "rcutils", "rmw", "rcpputils", "fastcdr"),
)
_LIBRARIES: Final = (
    *("rosidl_runtime_c", DISPATCHER, FAST, "rosidl_typesupport_fastrtps_cpp", INTROSPECTION),
    *("rcutils", "fastcdr"),
)
_PACKAGE_LIBRARIES: Final = (
    "rosidl_generator_c",
    FAST,
    INTROSPECTION,
    DISPATCHER,
    "rosidl_generator_py",
)
_WORDS_OF_THE_COMPILER: Final = 12
_INSTALL: Final = "sudo apt-get install -y g++ libpython3-dev"


@dataclass(frozen=True, slots=True, kw_only=True)
class Toolchain:
    """Hold the ROS installation that is built against, and what it takes to compile."""

    prefix: Path
    python_include: Path
    numpy_include: Path

    @property
    def library_folder(self) -> Path:
        """Return where the libraries of ROS are."""
        return self.prefix / "lib"


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectFiles:
    """Hold the object files of one package, by the shared object they go into."""

    introspection: tuple["Future[Path]", ...]
    fast: tuple["Future[Path]", ...]
    extension: tuple["Future[Path]", ...]


def find_toolchain(prefix: Path) -> Toolchain:
    """Check that everything that the build needs is installed.

    Raises:
        BuildToolMissing: a compiler, the headers of Python or of ROS, or NumPy is not.
    """
    for command, *_ in COMPILERS.values():
        if shutil.which(command) is None:
            raise BuildToolMissing(f"no {command} in PATH; {_INSTALL}")
    include = Path(sysconfig.get_paths()["include"])
    if not (include / "Python.h").is_file():
        raise BuildToolMissing(f"no {include}/Python.h, the headers of this Python; {_INSTALL}")
    headers = prefix / "include" / "rosidl_runtime_c"
    if not headers.is_dir():
        raise BuildToolMissing(
            f"no folder {headers}, the headers of ROS; pip install -r requirements-ros.lock"
        )
    try:
        import numpy
    except ImportError as error:
        raise BuildToolMissing(
            f"no NumPy in this environment: {error}; pip install numpy"
        ) from error
    return Toolchain(prefix=prefix, python_include=include, numpy_include=Path(numpy.get_include()))


def compile_sources(
    package: GeneratedPackage,
    siblings: Mapping[str, GeneratedPackage],
    toolchain: Toolchain,
    pool: ThreadPoolExecutor,
) -> ObjectFiles:
    """Start to compile every source of a package; `siblings` were generated before it."""
    include = toolchain.prefix / "include"
    others = [name for name in package.needs if name not in siblings]
    folders = [
        *(package.root.parent, package.introspection_root),
        *(toolchain.python_include, toolchain.numpy_include),
        *(include / name for name in (*_ALWAYS_INCLUDED, *others)),
        *(
            folder
            for name in package.needs
            if name in siblings
            for folder in (siblings[name].root.parent, siblings[name].introspection_root)
        ),
        include,
    ]
    options = [*_FLAGS, *os.environ.get("CFLAGS", "").split(), *(f"-I{one}" for one in folders)]

    def submit(sources: Iterable[Path]) -> tuple["Future[Path]", ...]:
        return tuple(pool.submit(_compile, source, options) for source in sources)

    sources = _sources(package.root)
    fast = [source for source in sources if source.name.endswith("__type_support_c.cpp")]
    own = [source for source in sources if source.parent.name == "detail" and source not in fast]
    return ObjectFiles(
        introspection=submit([*_sources(package.introspection_root), *own]),
        fast=submit(fast),
        extension=submit(source for source in sources if source not in fast and source not in own),
    )


def _sources(folder: Path) -> list[Path]:
    return sorted(file for file in folder.rglob("*") if file.suffix in COMPILERS)


def _compile(source: Path, options: Sequence[str]) -> Path:
    target = source.with_name(f"{source.name}.o")
    _run([*COMPILERS[source.suffix], *options, "-c", str(source), "-o", str(target)])
    return target


def link(package: GeneratedPackage, objects: ObjectFiles, out: Path, toolchain: Toolchain) -> None:
    """Link the shared objects of a package into `out/<package>` and copy its Python modules there.

    Packages that it needs and that were built before are in `out`, too.

    Raises:
        CompilationFailed: a source could not be compiled, or the objects could not be linked.
    """
    folder, libraries = out / package.name, toolchain.library_folder
    folder.mkdir(parents=True)
    options = [f"-L{libraries}", f"-Wl,-rpath,$ORIGIN:{libraries}", "-Wl,--allow-shlib-undefined"]
    options += ["-Wl,--as-needed", *(f"-l{name}" for name in _LIBRARIES)]
    for need in package.needs:
        if (out / need).is_dir():
            options += [*map(str, sorted((out / need).glob("*.so")))]
            options.append(f"-Wl,-rpath,$ORIGIN/../{need}")
            continue
        names = [f"{need}__{library}" for library in _PACKAGE_LIBRARIES]
        options += [f"-l{name}" for name in names if (libraries / f"lib{name}.so").exists()]
    extension = f"{package.name}_s__{DISPATCHER}{sysconfig.get_config_var('EXT_SUFFIX')}"
    made: list[str] = []
    for name, parts in (
        (f"lib{package.name}__{INTROSPECTION}.so", objects.introspection),
        (f"lib{package.name}__{FAST}.so", objects.fast),
        (extension, objects.extension),
    ):
        target, files = str(folder / name), [str(part.result()) for part in parts]
        command = ["g++", "-shared", "-s", "-o", target, f"-Wl,-soname,{name}", *files]
        _run([*command, "-Wl,--no-as-needed", *made, *options])
        made.append(target)
    for module in package.root.rglob("*.py"):
        copy = folder / module.relative_to(package.root)
        copy.parent.mkdir(exist_ok=True)
        shutil.copy(module, copy)


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        words = "\n".join(done.stderr.strip().splitlines()[-_WORDS_OF_THE_COMPILER:])
        raise CompilationFailed(f"{' '.join(command)}\nended with {done.returncode}:\n{words}")
