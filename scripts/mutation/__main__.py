"""Change one thing in the package and run its tests: a change that no test notices is a hole.

    .venv/bin/python scripts/mutation [--only TEXT ...] [--jobs N] [--list]

The tests are collected once; each mutant runs in a fork. Inside a function its code is exchanged
and only the tests that reach the line run; anywhere else, and where only an import reaches it, the
package is imported anew. The first test that fails ends it. Mutants that change nothing are listed,
each with its reason, in `equivalent_mutants.toml` beside the tests.
"""

import argparse
import importlib.abc
import importlib.machinery
import os
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import CodeType, ModuleType
from typing import NoReturn

os.environ["CI"] = "1"  # hypothesis then draws the same examples every time

import coverage
import pytest
from _pytest.runner import runtestprotocol
from mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
PACKAGE = "vla_deploy/safety"
OPTIONS = ("-q", "-s", "--no-header", "-p", "no:cacheprovider", "--timeout=30")
SURVIVED, KILLED = 0, 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Name what is changed and what has to notice it: the tests of a package mirror it."""

    root: Path
    package: str

    @property
    def tests(self) -> Path:
        """Return the folder of the package's tests."""
        return self.root / "tests" / self.package

    def mutants(self) -> list[Mutant]:
        """Return every mutant of every module of the package."""
        found = []
        for path in sorted((self.root / self.package).rglob("*.py")):
            parts = path.relative_to(self.root).with_suffix("").parts
            if parts[-1] != "__init__":
                found += mutants_of(path, ".".join(parts))
        return found

    def equivalent(self) -> dict[str, str]:
        """Return the reason of each mutant that is listed as changing nothing."""
        path = self.tests / "equivalent_mutants.toml"
        rows = tomllib.loads(path.read_text())["equivalent"] if path.exists() else []
        return {row["mutant"]: row["reason"] for row in rows}


class Campaign:
    """Run every mutant once the tests are collected; a plugin of pytest."""

    def __init__(
        self, target: Target, mutants: Sequence[Mutant], equivalent: dict[str, str], jobs: int
    ) -> None:
        self.survivors: list[str] = []
        self.faults: list[str] = []
        self.counts: Counter[tuple[str, str]] = Counter()
        self._target = target
        self._mutants = mutants
        self._equivalent = equivalent
        self._jobs = jobs
        self._reach: dict[str, dict[int, list[str]]] = {}
        self._seconds: dict[str, float] = {}

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run the tests as they are, then each mutant in a fork."""
        self._run_unchanged(session)
        self._import_unchanged(session)
        running: dict[int, Mutant] = {}
        for mutant in sorted(self._mutants, key=lambda mutant: not mutant.function):
            while len(running) >= self._jobs:
                self._collect(running)
            sys.stdout.flush()
            pid = os.fork()
            if pid == 0:
                self._end(mutant, session)
            running[pid] = mutant
        while running:
            self._collect(running)
        return True

    def _collect(self, running: dict[int, Mutant]) -> None:
        pid, status = os.wait()
        mutant = running.pop(pid)
        code, listed = os.waitstatus_to_exitcode(status), mutant.name in self._equivalent
        outcome = "killed" if code == KILLED else "equivalent" if listed else "survived"
        self.counts[mutant.path.name, outcome] += 1
        if self.counts.total() % 50 == 0:
            print(f"{self.counts.total()} of {len(self._mutants)}", flush=True)
        if code not in (SURVIVED, KILLED):
            self.faults.append(f"this tool could not run it (exit code {code}): {mutant.name}")
        elif outcome == "survived":
            self.survivors.append(f"{mutant.path.name}:{mutant.first_line}: {mutant.name}")
            print(f"survived: {self.survivors[-1]}", flush=True)
        elif listed and outcome == "killed":
            self.faults.append(f"listed as equivalent, but a test fails: {mutant.name}")

    def _end(self, mutant: Mutant, session: pytest.Session) -> NoReturn:
        """Run one mutant and leave this process, whatever happens."""
        code = os.EX_SOFTWARE
        try:
            code = SURVIVED if self._survives(mutant, session) else KILLED
        finally:
            os._exit(code)

    def pytest_collection_finish(self) -> None:
        """Spare what only helps a reader of failures; pytest calls this."""
        _without_shrinking()

    def _run_unchanged(self, session: pytest.Session) -> None:
        measure = coverage.Coverage(
            data_file=None,
            source=[str(self._target.root / self._target.package)],
            config_file=False,
        )
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

    def _import_unchanged(self, session: pytest.Session) -> None:
        """Make sure that importing anew fails no test by itself, which would look like a kill."""
        first = self._mutants[0] if self._mutants else None
        if first is None:
            return
        same = replace(first, function="", changed=first.node)
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            self._end(same, session)
        if os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) != SURVIVED:
            pytest.exit("the tests fail when the package is imported anew without any change", 1)

    def _survives(self, mutant: Mutant, session: pytest.Session) -> bool:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        code = compile(mutant.tree, str(mutant.path), "exec")
        items = self._items(mutant, session)
        if not items or not mutant.function or not _exchange(mutant, code):
            return _passes_anew(mutant, code, self._target, _QuickestFirst(self._seconds))
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


class _Loader(importlib.machinery.SourceFileLoader):
    """Load one module from changed code."""

    def __init__(self, mutant: Mutant, code: CodeType) -> None:
        super().__init__(mutant.module, str(mutant.path))
        self._code = code

    def get_code(self, fullname: str) -> CodeType:
        """Return the changed code; the import system calls this."""
        return self._code


class _Finder(importlib.abc.MetaPathFinder):
    """Find one module in changed code."""

    def __init__(self, loader: _Loader) -> None:
        self._loader = loader

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return where that module is, None for any other; the import system calls this."""
        if fullname != self._loader.name:
            return None
        origin = str(self._loader.path)
        return importlib.machinery.ModuleSpec(fullname, self._loader, origin=origin)


class _QuickestFirst:
    """Order the tests of a run anew by what they took."""

    def __init__(self, seconds: dict[str, float]) -> None:
        self._seconds = seconds

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Sort them; pytest calls this."""
        items.sort(key=lambda item: self._seconds.get(item.nodeid, 0.0))
        _without_shrinking()


def _without_shrinking() -> None:
    from hypothesis import Phase, settings  # not earlier: pytest has to rewrite its plugin first

    settings.register_profile("mutation", settings(), phases=(Phase.explicit, Phase.generate))
    settings.load_profile("mutation")


def _passes_anew(mutant: Mutant, code: CodeType, target: Target, order: _QuickestFirst) -> bool:
    """Import package and tests once more, one module of it from changed code."""
    ours = tuple(f"{target.root / part}/" for part in (Path(target.package).parts[0], "tests"))
    for name, module in list(sys.modules.items()):
        if (getattr(module, "__file__", None) or "").startswith(ours):
            del sys.modules[name]
    sys.meta_path.insert(0, _Finder(_Loader(mutant, code)))
    return pytest.main(["-x", *OPTIONS, str(target.tests)], plugins=[order]) == 0


def _report(campaign: Campaign) -> str:
    """Return one line per file, one per fault."""
    outcomes = ("killed", "equivalent", "survived")
    lines = [f"{'file':26}" + "".join(f"{outcome:>12}" for outcome in outcomes)]
    for file in sorted({file for file, _ in campaign.counts}):
        numbers = (campaign.counts[file, outcome] for outcome in outcomes)
        lines.append(f"{file:26}" + "".join(f"{number:12}" for number in numbers))
    return "\n".join([*lines, *campaign.faults])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Change a package in every small way, and test.")
    parser.add_argument("--only", nargs="+", default=[""], help="only what contains one of these")
    parser.add_argument("--list", action="store_true", help="print the mutants and run none")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="how many run at once")
    parser.add_argument("--root", type=Path, default=ROOT, help="where package and tests lie")
    parser.add_argument("--package", default=PACKAGE, help="its folder, from the root")
    return parser


def main() -> int:
    """Return 0 when every mutant was noticed, or is listed as changing nothing."""
    given = _parser().parse_args()
    target, began = Target(root=given.root, package=given.package), time.perf_counter()
    target, began = Target(root=given.root, package=given.package), time.perf_counter()
    every, equivalent = target.mutants(), target.equivalent()
    named = ((f"{mutant.path.name} {mutant.name}", mutant) for mutant in every)
    mutants = [mutant for name, mutant in named if any(text in name for text in given.only)]
    campaign = Campaign(target, mutants, equivalent, given.jobs)
    campaign.faults += [
        f"listed as equivalent, but there is no such mutant: {name}"
        for name in sorted(equivalent.keys() - {mutant.name for mutant in every})
    ]
    if given.list:
        print("\n".join(f"{one.path.name}:{one.first_line}: {one.name}" for one in mutants))
        print("\n".join(campaign.faults), end="")
        return 1 if campaign.faults else 0
    sys.path.insert(0, str(given.root))
    code = pytest.main([*OPTIONS, str(target.tests)], plugins=[campaign])
    print(_report(campaign))
    print(f"{len(mutants)} mutants, {len(campaign.survivors)} survived, ", end="")
    print(f"{time.perf_counter() - began:.0f} s")
    return 1 if code or campaign.survivors or campaign.faults else 0


if __name__ == "__main__":
    sys.exit(main())
