"""A switch ends with a release that works, whatever fails and wherever it is cut off."""

import dataclasses
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.install.errors import ReleaseRefused, SystemCommandFailed
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.switch import (
    NEXT,
    End,
    ServiceState,
    Switch,
    SwitchPlan,
    SwitchStep,
    recover,
    trouble_within,
)

GUARD = Path(__file__).parents[3] / "systemd" / "release-guard"
TROUBLES = (
    "degraded: planner back-off (exit code 1)",
    "all 9 processes ready; not in time: control: tick rate 90 Hz, limit 125 Hz",
)
PROGRAM = '#!/bin/sh\ntest ! -e "$(dirname "$0")/broken"\n'


class ManualClock:
    """Time passes when somebody waits."""

    def __init__(self) -> None:
        self.time_ns = 0

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)


class RecordedService:
    """Answer as systemd does for a unit whose release is well, or fails as told."""

    def __init__(self, store: ReleaseStore, fails: dict[str, str] | None = None) -> None:
        self.started: list[str] = []
        self._store = store
        self._fails = fails or {}  # release -> "start", "later", or the status that it tells then
        self._asked = 0
        self.ticks = 0
        self.told: dict[str, Any] = {}

    def restart(self) -> None:
        self.started.append(self._store.current())
        self._asked = 0
        if self._fails.get(self.started[-1]) == "start":
            raise SystemCommandFailed("`systemctl restart vla-deploy.service` ended with 1")

    def state(self) -> ServiceState:
        self._asked += 1
        what = self._fails.get(self.started[-1] if self.started else self._store.current(), "")
        died = what == "later" and self._asked > 5
        told = ":" in what and (self._asked > 5 or not self.started)
        return ServiceState(
            active="active",
            main_pid=2 if died else 1,
            restarts=int(died),
            status=what if told else "all 9 processes ready",
        )

    def report(self) -> dict[str, Any]:
        what = self._fails.get(self._store.current(), "")
        self.ticks += what != "hangs"
        if what == "unreached":
            raise SystemCommandFailed("no robot runs in /run/vla-deploy")
        control = None if what == "silent" else {"state": "armed", "tick": self.ticks}
        return {"control": control, **self.told}


@pytest.fixture
def store(tmp_path: Path) -> ReleaseStore:
    (tmp_path / "boot").write_text("boot-1\n")
    for number, name in enumerate(("oldest", "old", "new")):
        program = tmp_path / "releases" / name / "bin" / "vla-deploy"
        program.parent.mkdir(parents=True)
        program.write_text(PROGRAM)
        program.chmod(0o755)
        os.utime(tmp_path / "releases" / name, (number, number))
    made = ReleaseStore(tmp_path, tmp_path / "boot")
    made.use("old")
    return made


def switch_of(store: ReleaseStore, service: RecordedService | None = None) -> Switch:
    plan = SwitchPlan(to="new", robot="butler", profile="desktop")
    return Switch(store, plan, service or RecordedService(store), ManualClock())


def guard(prefix: Path) -> None:
    """Run what systemd runs before each start."""
    subprocess.run(["sh", GUARD, prefix, prefix / "boot"], check=True, capture_output=True)


def test_every_step_leads_somewhere_and_every_end_is_reached() -> None:
    assert set(NEXT) == set(SwitchStep)
    reached = {follower for pair in NEXT.values() for follower in pair}
    assert reached == (set(SwitchStep) | set(End)) - {SwitchStep.CHECK}


def test_a_good_release_is_used_and_the_one_before_is_remembered(store: ReleaseStore) -> None:
    service = RecordedService(store)
    report = switch_of(store, service).run()
    assert (report.end, report.current, report.failures) == (End.SWITCHED, "new", ())
    assert (store.previous(), store.trial(), service.started) == ("old", None, ["new"])


def test_a_release_that_does_not_run_changes_nothing(store: ReleaseStore) -> None:
    (store.folder("new") / "bin" / "broken").touch()
    service = RecordedService(store)
    report = switch_of(store, service).run()
    assert (report.end, report.current, service.started) == (End.REFUSED, "old", [])
    assert report.failures[0].startswith("check that the new release runs: ")


@pytest.mark.parametrize("when", ["start", "later", "hangs", "silent", "unreached", *TROUBLES])
def test_a_release_that_does_not_stay_well_is_taken_back(store: ReleaseStore, when: str) -> None:
    service = RecordedService(store, {"new": when})
    report = switch_of(store, service).run()
    assert (report.end, report.current) == (End.ROLLED_BACK, "old")
    assert service.started == ["new", "old"]
    assert store.trial() is None


@pytest.mark.parametrize("trouble", TROUBLES)
def test_a_release_is_not_blamed_for_what_was_known_before(
    store: ReleaseStore, trouble: str
) -> None:
    report = switch_of(store, RecordedService(store, {"old": trouble, "new": trouble})).run()
    assert (report.end, report.current) == (End.SWITCHED, "new")


def test_a_release_that_changes_the_trouble_is_blamed_for_it(store: ReleaseStore) -> None:
    service = RecordedService(store, {"old": TROUBLES[0], "new": TROUBLES[1]})
    report = switch_of(store, service).run()
    assert (report.end, report.current) == (End.ROLLED_BACK, "old")
    assert report.failures == (f"watch its health: it says: {TROUBLES[1]}",)


MOVING: dict[str, tuple[str, dict[str, Any]]] = {
    "a skill": ("skill pick_up", {"executor": {"state": "executing", "skill": "pick_up"}}),
    "a mission": ("mission m-1", {"motion": {"missions": ["m-1"]}}),
    "a motion": ("motions [7]", {"control": {"state": "armed", "tick": 1, "active_motions": [7]}}),
    "stopping": ("control is stopping", {"control": {"state": "stopping", "tick": 1}}),
    "the base": ("the base at", {"motion": {"base": {"speed_m_s": 0.02, "w_rad_s": 0.0}}}),
    "a turn": ("the base at", {"motion": {"base": {"speed_m_s": 0.0, "w_rad_s": -0.1}}}),
    "a joint": ("joint 3 at 0.06", {"motion": {"joint": {"number": 3, "velocity": 0.06}}}),
    "nobody knows": ("control is silent", {"control": None}),
}


@pytest.mark.parametrize("case", MOVING)
def test_a_robot_that_moves_is_not_restarted(store: ReleaseStore, case: str) -> None:
    words, told = MOVING[case]
    service = RecordedService(store)
    service.told = told
    report = switch_of(store, service).run()
    assert (report.end, report.current, service.started) == (End.REFUSED, "old", [])
    assert words in report.failures[0]
    service.told = {"motion": {"base": {"speed_m_s": 0.005, "w_rad_s": 0.0}, "joint": None}}
    assert switch_of(store, service).run().end is End.SWITCHED


def test_a_robot_that_does_not_answer_is_restarted_only_where_it_is_not_ready(
    store: ReleaseStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = RecordedService(store, {"old": "unreached"})
    assert "does not answer" in switch_of(store, service).run().failures[0]
    state = service.state()
    monkeypatch.setattr(
        service,
        "state",
        lambda: state if service.started else dataclasses.replace(state, active="activating"),
    )
    assert switch_of(store, service).run().end is End.SWITCHED


def test_a_service_that_is_down_with_either_release_is_reported(store: ReleaseStore) -> None:
    service = RecordedService(store, {"new": "start", "old": "start"})
    report = switch_of(store, service).run()
    assert (report.end, report.current, len(report.failures)) == (End.DOWN, "old", 2)


@pytest.mark.parametrize("step", [step for step in SwitchStep if not step.name.endswith("_BACK")])
def test_a_step_that_fails_ends_with_a_release_that_works(
    store: ReleaseStore, step: SwitchStep
) -> None:
    def fail() -> None:
        raise OSError(28, "No space left on device")

    switch = switch_of(store)
    switch.do[step] = fail
    report = switch.run()
    assert report.current == ("new" if step is SwitchStep.PRUNE else "old")
    assert store.trial() is None
    assert "No space left on device" in report.failures[0]


CUT = [(step, after) for step in SwitchStep for after in (False, True)]


@pytest.mark.parametrize(("step", "after"), CUT)
@pytest.mark.parametrize("is_reboot", [False, True], ids=["killed", "power cut"])
def test_a_switch_cut_off_at_any_step_is_ended_by_the_next_start(
    store: ReleaseStore, step: SwitchStep, after: bool, is_reboot: bool
) -> None:
    fails = {"new": "later"} if step.name.endswith("_BACK") else {}
    child = os.fork()
    if child == 0:  # pragma: no cover - the process that is cut off
        switch = switch_of(store, RecordedService(store, fails))
        act = switch.do[step]
        switch.do[step] = lambda: (act() if after else None, os.kill(os.getpid(), 9))  # type: ignore[assignment, func-returns-value]
        switch.run()
        os._exit(0)
    _, status = os.waitpid(child, 0)
    assert os.WTERMSIG(status) == 9
    if is_reboot:
        (store.prefix / "boot").write_text("boot-2\n")
    guard(store.prefix)
    kept = step is SwitchStep.PRUNE or (step is SwitchStep.CONFIRM and after)
    assert store.current() == ("new" if kept else "old")
    assert store.trial() is None
    assert (store.folder(store.current()) / "bin" / "vla-deploy").exists()
    recover(store, lambda pid: False)
    assert switch_of(store).run().end is End.SWITCHED if not kept else True


def test_the_guard_lets_a_watched_trial_start_once(store: ReleaseStore) -> None:
    store.begin_trial("new")
    store.use("new")
    guard(store.prefix)
    assert store.current() == "new"
    guard(store.prefix)
    assert store.current() == "old"
    assert store.last_rollback() == (
        "new: went back to old: the release on trial had to be started again"
    )


def test_the_guard_does_nothing_without_a_trial(store: ReleaseStore) -> None:
    guard(store.prefix)
    assert (store.current(), store.last_rollback()) == ("old", "")


def test_a_switch_that_goes_on_is_not_disturbed(store: ReleaseStore) -> None:
    store.begin_trial("new")
    with pytest.raises(ReleaseRefused, match="is going on"):
        recover(store, lambda pid: pid == os.getpid())
    assert store.trial() is not None
    (store.prefix / "boot").write_text("boot-2\n")  # the watcher's pid is another process now
    assert "was undone" in recover(store, lambda pid: pid == os.getpid())


@pytest.mark.parametrize(("to", "words"), [("old", "in use already"), ("none", "no release")])
def test_an_impossible_switch_is_refused(store: ReleaseStore, to: str, words: str) -> None:
    plan = SwitchPlan(to=to, robot="butler", profile="desktop")
    with pytest.raises(ReleaseRefused, match=words):
        Switch(store, plan, None, ManualClock()).run()


def test_old_releases_go_but_never_the_two_in_use(store: ReleaseStore) -> None:
    store.use("oldest")
    store.remember_previous("old")
    assert store.prune(keep=1) == ("new",)
    assert store.ids() == ("oldest", "old")


@pytest.mark.parametrize("release", ["old", "oldest"])
def test_what_is_in_use_cannot_be_removed(store: ReleaseStore, release: str) -> None:
    store.remember_previous("oldest")
    with pytest.raises(ReleaseRefused, match="switch to another first"):
        store.remove(release)


def test_health_is_watched_for_the_whole_time(store: ReleaseStore) -> None:
    clock, service = ManualClock(), RecordedService(store)
    service.restart()
    assert trouble_within(service, clock, 20.0) == ""
    assert clock.time_ns >= 20 * NS_PER_S
