"""Hold the tree to its own rules of names and rooms; `scripts/check` runs it.

    python scripts/house.py

It reads the sources, imports nothing of them, and prints one line for each rule that is broken.
"""

import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parent.parent
PACKAGES: Final = ("vla_deploy", "drivers", "platforms", "sim_twin", "benchmarks", "training")
MOST_MODULES: Final = 20
LARGE_FOLDERS: Final = {
    "benchmarks": "one module for each measurement, and what several of them share",
}
"""The folders with more modules than that, each with its reason."""
BANNED: Final = {
    r"^Tell\b": "say what is returned, held or published",
    r"\bheed": "follow, obey or use",
    r"\bwhoever\b": "name the caller, the process or the person",
    r"\bof late(?! ticks)\b": "say over which time",
}
"""Patterns that no docstring has, each with what to write instead (docs/glossary.md)."""
BANNED_NAMES: Final = {
    r"(^|_)desk(_|$)|Desk(?![a-z])": "manager, interface or queue",
    r"(^|_)heed": "apply or follow",
    r"(^|_)aside(_|$)": "executor or worker",
}
"""Patterns that no public name has, each with what to write instead."""

Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def sources() -> dict[str, ast.Module]:
    """Return the parsed modules of the product by their paths."""
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")))
    return {str(file.relative_to(ROOT)): ast.parse(file.read_bytes()) for file in files}


def doubled_names(modules: dict[str, ast.Module]) -> Iterator[str]:
    """Yield each public class name that more than one module defines."""
    places = defaultdict(list)
    for path, module in modules.items():
        for node in module.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(path)
    for name, paths in sorted(places.items()):
        if len(paths) > 1:
            yield f"class {name} is defined in {', '.join(paths)}: give each its own name"


def banned_words(modules: dict[str, ast.Module]) -> Iterator[str]:
    """Yield each docstring and public name that has a banned word."""
    for path, module in modules.items():
        for node in ast.walk(module):
            if not isinstance(node, Definition):
                continue
            where, text = f"{path}:{node.lineno}", ast.get_docstring(node, clean=False) or ""
            for pattern, instead in BANNED.items():
                if found := re.search(pattern, text):
                    yield f'{where}: "{found[0]}" in the docstring of {node.name}: {instead}'
            for pattern, instead in BANNED_NAMES.items():
                if not node.name.startswith("_") and re.search(pattern, node.name):
                    yield f"{where}: the name {node.name}: {instead}"


def crowded_folders(modules: dict[str, ast.Module]) -> Iterator[str]:
    """Yield each folder with too many modules, and each module that lies loose in vla_deploy."""
    counts: dict[str, int] = defaultdict(int)
    for path in modules:
        folder, _, name = path.rpartition("/")
        if name != "__init__.py":
            counts[folder] += 1
            if folder == "vla_deploy":
                yield f"{path} lies loose: move it to the room that it belongs to"
    for folder, count in sorted(counts.items()):
        if count > MOST_MODULES and folder not in LARGE_FOLDERS:
            yield f"{folder} has {count} modules, at most {MOST_MODULES}: group or merge them"
    for folder in LARGE_FOLDERS:
        if counts[folder] <= MOST_MODULES:
            yield f"{folder} has {counts[folder]} modules: it needs no exception in {__file__}"


def folders_without_init(modules: dict[str, ast.Module]) -> Iterator[str]:
    """Yield each folder of modules that is no package: the import linter does not see it."""
    for folder in sorted({path.rpartition("/")[0] for path in modules}):
        if f"{folder}/__init__.py" not in modules:
            yield f"{folder} has no __init__.py: add one, or lint-imports overlooks its modules"


def main() -> int:
    """Print what is wrong, and return whether anything is."""
    modules = sources()
    rules = (doubled_names, banned_words, crowded_folders, folders_without_init)
    wrong = [line for rule in rules for line in rule(modules)]
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
