"""Cut the power at each operation of `vla-deploy release`, start the computer, and judge it.

Each command runs once in a folder and is recorded; then the disk is laid out as a cut before each
of its operations may leave it, `release-guard` runs as at the boot, and the release in use has to
run, every release that is listed has to be whole, and the command has to work when it is repeated.
"""

import argparse
import contextlib
import io
import os
import random
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, Final

from drivers.clock import MonotonicClock
from sim_twin.campaigns.cutting.disk_history import (
    DiskHistory,
    StateChoice,
    as_drawn,
    as_emptied,
    as_killed,
    as_lost,
    recorded,
    synced_by,
)
from sim_twin.campaigns.report import CampaignCase, CampaignReport, told
from sim_twin.campaigns.selection import chosen
from vla_deploy.cli.main import main
from vla_deploy.install.errors import InstallError, SystemCommandFailed
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.switch import ServiceState, Switch, SwitchPlan, recover

DRAWS: Final = 4
_PREFIX: Final = "opt/vla-deploy"
_OTHER_BOOT: Final = "another-boot\n"
_RUN_S: Final = 20.0
_SHOWN: Final = 5
# Runs only where nothing of the release is missing or damaged.
_LAUNCHER: Final = """#!/bin/sh
cd "${{0%/bin/vla-deploy}}" && read -r name <share/name && test "$name" = "{name}" -a -s lib/a
"""
# Stands for a program that the guard calls: the power goes before the call that is counted to 0.
_COUNTED: Final = """#!/bin/sh
read -r left <"{count}"
echo $((left - 1)) >"{count}"
[ "$left" -gt 1 ] || kill -9 0
exec "{real}" "$@"
"""
_GUARD_CALLS: Final = 9  # of other programs, where it takes a release back
_VERSION: Final = "7.0"
_WORDS_OF_DONE: Final = ("is in use already", "no release", "there is no previous release")


@dataclass(frozen=True, slots=True, kw_only=True)
class CutScenario:
    """Say what there is before, what is done, and whether a release is in use whatever happens."""

    name: str
    releases: tuple[str, ...] = ("oldest", "old", "new")
    current: str = "old"
    previous: str = "oldest"
    act: Callable[[Path], None]
    repeats: bool = True


def _command(*words: str) -> Callable[[Path], None]:
    def act(root: Path) -> None:
        code, output = _release(root, *words)
        if code not in (0, 1):
            raise RuntimeError(f"release {' '.join(words)}: {output}")

    return act


def _taken_back(root: Path) -> None:
    """Switch to a release whose service does not become ready."""
    store = ReleaseStore(root / _PREFIX)
    recover(store, lambda _pid: False)
    plan = SwitchPlan(to="new", robot="butler", profile="desktop")
    Switch(store, plan, _DeadService(store), MonotonicClock()).run()


class _DeadService:
    """Stand for a unit that starts with the old release only, and for the robot that it runs."""

    def __init__(self, store: ReleaseStore) -> None:
        self._store = store

    def restart(self) -> None:
        """Fail with the new release."""
        if self._store.current() == "new":
            raise SystemCommandFailed("`systemctl restart` ended with 1")

    def state(self) -> ServiceState:
        """Return that it does not run."""
        return ServiceState(active="inactive", main_pid=1, restarts=0)

    def report(self) -> dict[str, Any]:
        """Reach nobody."""
        raise SystemCommandFailed("no robot runs")


def _add(root: Path) -> None:
    wheel = root / f"vla_deploy-{_VERSION}-py3-none-any.whl"
    _write_wheel(wheel)
    code, output = _release(root, "add", str(wheel), "--unsigned", "--id", "added")
    if code:
        raise RuntimeError(output)


SCENARIOS: Final = (
    CutScenario(name="switch", act=_command("switch", "new")),
    CutScenario(name="first switch", current="", previous="", act=_command("switch", "new")),
    CutScenario(name="rollback", act=_command("rollback")),
    CutScenario(
        name="switch and prune",
        releases=("a", "b", "oldest", "old", "new"),
        act=_command("switch", "new", "--keep", "1"),
    ),
    CutScenario(name="taken back", act=_taken_back),
    CutScenario(name="remove", act=_command("remove", "new")),
    CutScenario(name="add", act=_add, repeats=False),
)


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Play every scenario, with `options.count` random states of the disk at each operation."""
    draws = DRAWS if options.count is None else options.count
    scenarios = chosen(SCENARIOS, options.only, lambda one: one.name)
    cases = [told(played(one, draws, options.seed), tell) for one in scenarios]
    summary = {
        name: sum(case.figures[name] for case in cases)
        for name in ("operations", "cuts", "unusable")
    }
    return CampaignReport(campaign="power-cuts", cases=tuple(cases), summary=summary)


def played(scenario: CutScenario, draws: int, seed: int, every: int = 1) -> CampaignCase:
    """Cut one scenario before each operation, or each one of `every`."""
    began_s = perf_counter()
    with tempfile.TemporaryDirectory(prefix="vla-cuts-") as folder:
        root = Path(folder) / "recorded"
        _prepare(root, scenario)
        with recorded(root / _PREFIX) as history:
            scenario.act(root)
        cuts, failures, on_trial_until = 0, [], history.last_with("trial")
        for number, state in enumerate(_states(history, draws, seed, every)):
            left = Path(folder) / str(number)
            history.lay_out(state.cut, state.choose, left / _PREFIX)
            if state.guard_calls and not (left / _PREFIX / "trial").exists():
                shutil.rmtree(left)  # the guard has nothing to do, so nothing to be cut off
                continue
            cuts += 1
            with synced_by(lambda _fd: None, lambda: None):
                trouble = _trouble(left, scenario, state, is_proved=state.cut > on_trial_until)
            if trouble:
                failures.append(f"{state.name} ({history.operations[state.cut]}): {trouble}")
            shutil.rmtree(left)
    figures = {"operations": len(history.operations), "cuts": cuts, "unusable": len(failures)}
    more = [f"and {len(failures) - _SHOWN} more"] if len(failures) > _SHOWN else []
    return CampaignCase(
        name=scenario.name,
        failures=(*failures[:_SHOWN], *more),
        figures=figures,
        seconds=perf_counter() - began_s,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _CutState:
    """Say before which operation the power goes, what that leaves, and what comes after.

    `guard_calls` is the number of programs that `release-guard` calls before the power goes again,
    0 where it stays. Without a boot the command is repeated at once: only the program was killed.
    """

    what: str
    cut: int
    choose: StateChoice
    is_boot: bool = True
    guard_calls: int = 0

    @property
    def name(self) -> str:
        return f"{self.what} before {self.cut}"


def _states(history: DiskHistory, draws: int, seed: int, every: int) -> Iterator[_CutState]:
    for cut in range(0, len(history.operations), every):
        yield _CutState(what="no boot", cut=cut, choose=as_killed, is_boot=False)
        yield _CutState(what="killed", cut=cut, choose=as_killed)
        yield _CutState(what="lost", cut=cut, choose=as_lost)
        yield _CutState(what="emptied", cut=cut, choose=as_emptied)
        for draw in range(draws):
            choose = as_drawn(random.Random(f"{seed}/{cut}/{draw}"))
            yield _CutState(what=f"torn {draw}", cut=cut, choose=choose)
        for calls in range(1, _GUARD_CALLS + 1):
            what = f"guard cut at {calls}"
            yield _CutState(what=what, cut=cut, choose=as_killed, guard_calls=calls)


def _prepare(root: Path, scenario: CutScenario) -> None:
    code, output = _quietly("install", "--root", str(root))
    if code:
        raise RuntimeError(output)
    store = ReleaseStore(root / _PREFIX)
    for name in scenario.releases:
        _write_release(store.prefix / "releases" / name, name)
    store.use(scenario.current)
    store.remember_previous(scenario.previous)


def _write_release(folder: Path, name: str) -> None:
    for path, content in (("share/name", f"{name}\n"), ("lib/a", "a")):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(content)
    program = folder / "bin" / "vla-deploy"
    program.parent.mkdir()
    program.write_text(_LAUNCHER.format(name=name))
    program.chmod(0o755)


def _write_wheel(wheel: Path) -> None:
    """Write a wheel that stands for the product: its command line does nothing, and ends well."""
    stem = f"vla_deploy-{_VERSION}"
    metadata = f"Metadata-Version: 2.1\nName: vla-deploy\nVersion: {_VERSION}\n"
    tags = "Wheel-Version: 1.0\nGenerator: cuts\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("vla_deploy/cli/__main__.py", "import vla_deploy.whole\n")
        archive.writestr("vla_deploy/whole.py", "WHOLE = 1\n")
        archive.writestr(f"{stem}.dist-info/METADATA", metadata)
        archive.writestr(f"{stem}.dist-info/WHEEL", tags)
        archive.writestr(f"{stem}.dist-info/RECORD", "")


def _trouble(root: Path, scenario: CutScenario, state: _CutState, *, is_proved: bool) -> str:
    """Return what does not work on a computer that is started after the cut, "" where all does."""
    store = ReleaseStore(root / _PREFIX)
    if state.guard_calls:
        _cut_guard(store, root / "programs", state.guard_calls)
    if state.is_boot:
        trouble = _boot(store)
        if trouble:
            return trouble
        if not is_proved and scenario.current not in ("", store.current()):
            return f"{store.current()} is in use, and has not proved itself"
    trouble = _store_trouble(store, scenario)
    if trouble or not scenario.repeats:
        return trouble
    try:
        scenario.act(root)
    except (RuntimeError, OSError, InstallError) as error:
        if not any(words in str(error) for words in _WORDS_OF_DONE):
            return f"repeated: {error}"
    return _store_trouble(store, scenario) or ("a trial is left" if store.trial() else "")


def _boot(store: ReleaseStore) -> str:
    done = _guard(store, os.environ["PATH"])
    if done.returncode:
        return f"release-guard ended with {done.returncode}: {done.stderr.strip()}"
    return "release-guard has left a trial" if (store.prefix / "trial").exists() else ""


def _guard(store: ReleaseStore, path: str) -> subprocess.CompletedProcess[str]:
    boot = store.prefix / "boot"
    boot.write_text(_OTHER_BOOT)
    command = ["sh", str(store.prefix / "libexec/release-guard"), str(store.prefix), str(boot)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=_RUN_S,
        check=False,
        env={"PATH": path},
        start_new_session=True,  # what cuts it off kills its whole group
    )


def _cut_guard(store: ReleaseStore, programs: Path, calls: int) -> None:
    """Run the guard up to its call number `calls` of another program."""
    programs.mkdir()
    count = programs / "count"
    count.write_text(f"{calls}\n")
    for name in ("cat", "ln", "mv", "rm", "sed", "sync"):
        program = programs / name
        real = shutil.which(name)
        program.write_text(_COUNTED.format(count=count, real=real))
        program.chmod(0o755)
    _guard(store, f"{programs}:{os.environ['PATH']}")


def _store_trouble(store: ReleaseStore, scenario: CutScenario) -> str:
    """Return which release does not run, of all that are listed; the one in use is the worst."""
    broken = [name for name in store.ids() if not _runs(store, name)]
    current = store.current()
    if not current and scenario.current:
        return f"no release is in use, expected {scenario.current}"
    if current and (current in broken or current not in store.ids()):
        return f"release {current}, in use, does not run"
    return f"listed, but not whole: {', '.join(broken)}" if broken else ""


def _runs(store: ReleaseStore, release: str) -> bool:
    program = store.prefix / "releases" / release / "bin" / "vla-deploy"
    if not program.is_file():
        return False
    try:
        done = subprocess.run([program, "check"], capture_output=True, timeout=_RUN_S, check=False)
    except PermissionError:
        return False
    return done.returncode == 0


def _release(root: Path, *words: str) -> tuple[int, str]:
    place = ("--root", str(root), "--robot", "butler", "--profile", "desktop")
    return _quietly("release", *words, *place)


def _quietly(*words: str) -> tuple[int, str]:
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        code = main(list(words))
    return code, output.getvalue().strip()
