"""Generate the sources of one interface package with ROS's own generators.

They are Python functions that each take one JSON file of arguments, as CMake calls them. All write
into `<work>/<package>/<package>`, so that `#include "<package>/msg/..."` finds its way; only the
introspection type support has a folder of its own, as its files have the same names as others.
"""

import contextlib
import importlib
import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from interface_builder.definitions import InterfacePackage
from interface_builder.errors import BuildToolMissing, DefinitionsInvalid

FAST: Final = "rosidl_typesupport_fastrtps_c"
INTROSPECTION: Final = "rosidl_typesupport_introspection_c"
DISPATCHER: Final = "rosidl_typesupport_c"
GENERATORS: Final = (
    "rosidl_adapter",
    "rosidl_generator_type_description",
    "rosidl_generator_c",
    FAST,
    INTROSPECTION,
    DISPATCHER,
    "rosidl_generator_py",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneratedPackage:
    """Hold where the generated sources of a package lie, and which packages they need."""

    name: str
    root: Path
    introspection_root: Path
    needs: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Generation:
    package: InterfacePackage
    folder: Path
    share: Path
    folders: Mapping[str, Path]
    idl: list[str] = field(default_factory=list)

    @property
    def root(self) -> Path:
        return self.folder / self.package.name

    def run(self, generator: str, function: str, *more: object, **extra: object) -> None:
        """Call a generator's function with its file of arguments."""
        arguments = {
            "package_name": self.package.name,
            "output_dir": str(self.root),
            "idl_tuples": self.idl,
            "target_dependencies": [],
            "template_dir": str(self.share / generator / "resource"),
            "ros_interface_dependencies": [
                f"{name}:{file}"
                for name, folder in self.folders.items()
                for file in folder.glob("*/*.idl")
            ],
            **extra,
        }
        file = self.folder / f"{generator}.json"
        file.write_text(json.dumps(arguments), encoding="utf-8")
        getattr(generator_module(generator), function)(str(file), *more)


def generator_module(name: str) -> Any:
    """Import one of ROS's generators.

    Raises:
        BuildToolMissing: its wheel is not installed in this environment.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        wheel = f"ros-{name.replace('_', '-')}"
        raise BuildToolMissing(
            f"no Python module {name} in this environment ({error}); it is of the wheel {wheel}: "
            "pip install -r requirements-ros.lock"
        ) from error


def generate(
    package: InterfacePackage,
    work: Path,
    share: Path,
    needs: tuple[str, ...],
    folders: Mapping[str, Path],
) -> GeneratedPackage:
    """Write the sources of `package` below `work`; `folders` holds the IDL of those it needs.

    Raises:
        DefinitionsInvalid: a definition cannot be parsed.
        BuildToolMissing: a generator is not installed.
    """
    generation = _Generation(
        package=package,
        folder=work / package.name,
        share=share,
        folders={name: folders[name] for name in needs},
    )
    generation.root.mkdir(parents=True)
    noise = io.StringIO()
    with contextlib.redirect_stdout(noise):
        _convert(generation)
        _generate_c(generation)
    (generation.root / "__init__.py").touch()
    return GeneratedPackage(
        name=package.name,
        root=generation.root,
        introspection_root=generation.folder / "introspection",
        needs=needs,
    )


def _convert(generation: _Generation) -> None:
    """Turn each definition into IDL, and name the result with its package's root."""
    package, convert = generation.package, generator_module("rosidl_adapter").convert_to_idl
    for file in package.files:
        try:
            written = convert(package.folder, package.name, file, generation.root)
        except Exception as error:  # the parser raises many kinds, all about the text of this file
            raise DefinitionsInvalid(
                f"{package.folder / file}: {type(error).__name__}: {error}"
            ) from error
        generation.idl.append(f"{generation.root}:{Path(written).relative_to(generation.root)}")


def _generate_c(generation: _Generation) -> None:
    package, root = generation.package, generation.root
    generation.run(
        "rosidl_generator_type_description",
        "generate_type_hash",
        include_paths=[f"{name}:{folder}" for name, folder in generation.folders.items()],
    )
    relative = [tuple_.rpartition(":")[2] for tuple_ in generation.idl]
    generation.run(
        "rosidl_generator_c",
        "generate_c",
        type_description_tuples=[f"{one}:{(root / one).with_suffix('.json')}" for one in relative],
        ros_interface_files=[str(package.folder / file) for file in package.files],
    )
    generation.run(FAST, "generate_typesupport_fastrtps_c")
    introspection = generation.folder / "introspection" / package.name
    generation.run(INTROSPECTION, "generate_c", output_dir=str(introspection))
    generation.run(DISPATCHER, "generate_c", [FAST, INTROSPECTION])
    for generator in ("rosidl_generator_c", FAST, INTROSPECTION):
        _write_visibility_header(generation, generator)
    generation.run("rosidl_generator_py", "generate_py", [DISPATCHER])


def _write_visibility_header(generation: _Generation, generator: str) -> None:
    """Fill in the one header that CMake configures instead of a generator."""
    name, header = generation.package.name, f"{generator}__visibility_control.h"
    template = (generation.share / generator / "resource" / f"{header}.in").read_text()
    (generation.root / "msg").mkdir(exist_ok=True)
    (generation.root / "msg" / header).write_text(
        template.replace("@PROJECT_NAME@", name).replace("@PROJECT_NAME_UPPER@", name.upper())
    )
