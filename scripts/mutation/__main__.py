"""Change one thing in the package and run its tests: a change that no test notices is a hole.

    .venv/bin/python scripts/mutation [--only TEXT] [--list]

The tests are collected once; each mutant runs in a fork. Inside a function its code is exchanged
and only the tests that reach the line run; anywhere else the package is imported anew. Mutants that
change nothing are listed, each with its reason, in `equivalent_mutants.toml` beside the tests.
"""

import argparse
import importlib.abc
import importlib.machinery
import os
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import CodeType, ModuleType

os.environ["CI"] = "1"  # hypothesis then draws the same examples every time

import coverage
import pytest
from _pytest.runner import runtestprotocol
from mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "vla_deploy" / "safety"
TESTS = ROOT / "tests" / "vla_deploy" / "safety"
EQUIVALENT = TESTS / "equivalent_mutants.toml"
OPTIONS = ("-q", "-s", "--no-header", "-p", "no:cacheprovider", "--timeout=30", str(TESTS))


class Campaign:
    """Run every mutant once the tests are collected; a plugin of pytest."""

    def __init__(self, mutants: Sequence[Mutant], equivalent: dict[str, str]) -> None:
        self.survivors: list[str] = []
        self.faults: list[str] = []
        self._mutants = mutants
        self._equivalent = equivalent
        self._reach: dict[str, dict[int, list[str]]] = {}
        self._seconds: dict[str, float] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests as they are, then each mutant in a fork."""
        self._run_unchanged(session)
        running: dict[int, Mutant] = {}
        for mutant in self._mutants:
            while len(running) >= (os.cpu_count() or 1):
                self._collect(running)
            sys.stdout.flush()
            pid = os.fork()
            if pid == 0:
                os._exit(0 if self._survives(mutant, session) else 1)
            running[pid] = mutant
        while running:
            self._collect(running)
        return True

    def _collect(self, running: dict[int, Mutant]) -> None:
        pid, status = os.wait()
        mutant = running.pop(pid)
        survived, listed = status == 0, mutant.name in self._equivalent
        if survived and not listed:
            self.survivors.append(f"{mutant.path.name}:{mutant.first_line}: {mutant.name}")
            print(f"survived: {self.survivors[-1]}")
        elif listed and not survived:
            self.faults.append(f"listed as equivalent, but a test fails: {mutant.name}")

    def _run_unchanged(self, session: pytest.Session) -> None:
        measure = coverage.Coverage(data_file=None, source=[str(PACKAGE)], config_file=False)
        measure.start()
        for at, item in enumerate(session.items):
            measure.switch_context(item.nodeid)
            began = time.perf_counter()
            following = session.items[at + 1] if at + 1 < len(session.items) else None
            reports = runtestprotocol(item, log=False, nextitem=following)
            self._seconds[item.nodeid] = time.perf_counter() - began
            if any(report.failed for report in reports):
                pytest.exit(f"{item.nodeid} fails without any change; mend it first", 1)
        measure.stop()
        data = measure.get_data()
        self._reach = {name: data.contexts_by_lineno(name) for name in data.measured_files()}

    def _survives(self, mutant: Mutant, session: pytest.Session) -> bool:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        code = compile(mutant.tree, str(mutant.path), "exec")
        if not mutant.function or not _exchange(mutant, code):
            return _passes_anew(mutant, code, _QuickestFirst(self._seconds))
        items = self._items(mutant, session)
        for at, item in enumerate(items):
            following = items[at + 1] if at + 1 < len(items) else None
            reports = runtestprotocol(item, log=False, nextitem=following)
            if any(report.failed for report in reports):
                return False
        return True

    def _items(self, mutant: Mutant, session: pytest.Session) -> list[pytest.Item]:
        """Return the tests that reach the mutant, the quickest first."""
        lines = self._reach.get(str(mutant.path), {})
        span = range(mutant.first_line, mutant.last_line + 1)
        names = {name for line in span for name in lines.get(line, ())}
        items = [item for item in session.items if item.nodeid in names]
        return sorted(items, key=lambda item: self._seconds[item.nodeid])


def _exchange(mutant: Mutant, code: CodeType) -> bool:
    """Give the living function its changed code; False where it cannot be found."""
    changed = next((c for c in _codes(code) if c.co_qualname == mutant.function), None)
    living: object = sys.modules.get(mutant.module)
    for name in mutant.function.split("."):
        living = vars(living).get(name) if isinstance(living, ModuleType | type) else None
    for wrapper in ("fget", "__func__", "__wrapped__"):
        living = getattr(living, wrapper, living)
    if changed is None or not hasattr(living, "__code__"):
        return False
    living.__code__ = changed
    return True


def _codes(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _codes(constant)


class _Loader(importlib.abc.MetaPathFinder, importlib.machinery.SourceFileLoader):
    """Import one module from changed code."""

    def __init__(self, mutant: Mutant, code: CodeType) -> None:
        super().__init__(mutant.module, str(mutant.path))
        self._code = code

    def find_spec(self, fullname, path=None, target=None):  # type: ignore[no-untyped-def]
        if fullname != self.name:
            return None
        return importlib.machinery.ModuleSpec(fullname, self, origin=self.path)

    def get_code(self, fullname):  # type: ignore[no-untyped-def]
        return self._code


class _QuickestFirst:
    """Order the tests of a run anew by what they took."""

    def __init__(self, seconds: dict[str, float]) -> None:
        self._seconds = seconds

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Sort them; pytest calls this."""
        items.sort(key=lambda item: self._seconds.get(item.nodeid, 0.0))


def _passes_anew(mutant: Mutant, code: CodeType, order: _QuickestFirst) -> bool:
    """Import package and tests once more, one module of it from changed code."""
    for name in [name for name in sys.modules if name.split(".")[0] in ("vla_deploy", "tests")]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Loader(mutant, code))
    return pytest.main(["-x", *OPTIONS], plugins=[order]) == 0


def _package_mutants() -> list[Mutant]:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[-1] != "__init__":
            found += mutants_of(path, ".".join(parts))
    return found


def _equivalent() -> dict[str, str]:
    rows = tomllib.loads(EQUIVALENT.read_text())["equivalent"] if EQUIVALENT.exists() else []
    return {row["mutant"]: row["reason"] for row in rows}


def main() -> int:
    """Return 0 when every mutant was noticed, or is listed as changing nothing."""
    parser = argparse.ArgumentParser(description="Run the mutation campaign of vla_deploy/safety.")
    parser.add_argument("--only", default="", help="only mutants whose name contains this")
    parser.add_argument("--list", action="store_true", help="print the mutants and run none")
    given = parser.parse_args()
    every, equivalent = _package_mutants(), _equivalent()
    mutants = [mutant for mutant in every if given.only in f"{mutant.path.name} {mutant.name}"]
    if given.list:
        print("\n".join(f"{one.path.name}:{one.first_line}: {one.name}" for one in mutants))
        return 0
    campaign, began = Campaign(mutants, equivalent), time.perf_counter()
    code = pytest.main(list(OPTIONS), plugins=[campaign])
    gone = sorted(equivalent.keys() - {mutant.name for mutant in every})
    campaign.faults += [
        f"listed as equivalent, but there is no such mutant: {name}" for name in gone
    ]
    print("\n".join(campaign.faults))
    print(
        f"{len(mutants)} mutants, {len(campaign.survivors)} survived, {len(equivalent)} listed as "
        f"equivalent, {time.perf_counter() - began:.0f} s"
    )
    return 1 if code or campaign.survivors or campaign.faults else 0


if __name__ == "__main__":
    sys.exit(main())
