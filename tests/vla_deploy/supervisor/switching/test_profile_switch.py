""""""

import logging
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from platforms.power_switch import PowerSwitch
from vla_deploy.runtime.node import NeedsRestart
from vla_deploy.supervisor.profiles.profile_change import Member
from vla_deploy.supervisor.profiles.profile_switch import set_at_start

NAMES = ("control", "perception", "planner", "executor")


class Never(Executor):
    """Take work and never do it, as a load that hangs."""

    def submit(self, *_: Any, **__: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        return future


def keeps_swift(bench: Any) -> None:
    """Check that nothing is left of a change."""
    assert bench.names() == {"swift"}
    assert bench.choice.load() is None
    assert bench.client.status["phase"] == ""
    for worker in bench.workers.values():
        assert worker.alive == {worker.content} == {"first"}


def test_every_process_switches_and_the_choice_is_kept(bench, profiles):
    last = bench.client.use(profiles["calm"])
    assert (last["outcome"], last["reason"]) == ("kept", "")
    assert bench.names() == {"calm"}
    assert bench.choice.load() == bench.client.status["profile"] == profiles["calm"]
    assert bench.client.status["begun_with"] == profiles["swift"]
    bench.tick()
    for worker in bench.workers.values():
        assert worker.alive == {worker.content} != {"first"}
    for kernel in bench.kernels.values():
        assert kernel.applied == ["calm"]


def test_that_the_chosen_profile_does_not_load_is_told_until_another_is_kept(bench, profiles):
    fault = "the chosen profile /home/me/mine.toml does not load: Permission denied"
    bench.supervision = bench.supervise(profiles["swift"], fault)
    bench.tick()
    assert bench.client.status["fault"] == fault
    bench.client.use(profiles["calm"], dry_run=True)
    assert bench.client.status["fault"] == fault
    bench.client.use(profiles["calm"])
    assert bench.client.status["fault"] == ""


@pytest.mark.parametrize("name", NAMES)
def test_a_profile_that_one_process_refuses_changes_nothing(bench, profiles, hinder, name):
    reason = hinder(bench, name)
    last = bench.client.use(profiles["calm"])
    assert (last["outcome"], last["reason"]) == ("refused", f"{name}: {reason}")
    keeps_swift(bench)


@pytest.mark.parametrize("name", NAMES)
def test_a_process_that_is_too_slow_after_the_switch_takes_all_of_them_back(bench, profiles, name):
    bench.workers[name].is_slow = True
    last = bench.client.use(profiles["calm"])
    assert last["outcome"] == "rolled back"
    assert last["reason"].startswith(f"{name}: steps at 20.")
    assert "expected 800.0 Hz" in last["reason"]
    keeps_swift(bench)
    assert all(kernel.applied == ["calm", "swift"] for kernel in bench.kernels.values())


def test_a_process_that_others_held_up_for_a_moment_takes_nothing_back(bench, profiles):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.dead.add("planner")
    began_ns = bench.clock.ns
    assert bench.run_until(lambda: bench.clock.ns > began_ns + NS_PER_S, 20.0)
    bench.dead.discard("planner")
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "kept"


def test_late_ticks_take_all_of_them_back(bench, profiles):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.late_ticks = 60
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "rolled back"
    assert "ticks late, expected 5% at most" in bench.client.last["reason"]
    keeps_swift(bench)


def test_whoever_holds_processes_back_hears_of_a_profile_before_they_do(bench, profiles):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.late_ticks = 60
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.adopted == [("calm", {"swift"}), ("swift", {"calm"})]


def test_a_process_over_its_memory_takes_all_of_them_back(bench, profiles):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.table.put_document({"processes": [{"name": "planner", "memory_mb": 151.0}]})
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "rolled back"
    assert bench.client.last["reason"] == "planner: 151 MB, expected 150 MB at most"
    keeps_swift(bench)


def test_a_dry_run_prepares_and_changes_nothing(bench, profiles):
    assert bench.client.use(profiles["calm"], dry_run=True)["outcome"] == "would work"
    keeps_swift(bench)


def test_a_preparation_that_hangs_is_given_up_in_time(bench, profiles):
    bench.executors["planner"] = Never()
    bench.start("planner", profiles["swift"])
    last = bench.client.use(profiles["calm"])
    assert (last["outcome"], last["reason"]) == (
        "refused",
        "planner: no answer to prepare in time",
    )
    assert 29.0 < last["took_s"] < 32.0
    assert bench.workers["planner"].steps > 500, "its steps go on meanwhile"


def test_a_preparation_that_comes_too_late_is_discarded(bench, profiles):
    pool = ThreadPoolExecutor(1)
    gate: Future[None] = Future()
    waiting = pool.submit(gate.result)
    bench.executors["planner"] = pool
    bench.start("planner", profiles["swift"])
    assert bench.client.use(profiles["calm"])["outcome"] == "refused"
    gate.set_result(None)
    waiting.result()
    pool.shutdown(wait=True)
    assert bench.workers["planner"].alive == {"first"}


@pytest.mark.parametrize("phase", ["prepare", "commit", "watch"])
def test_a_process_that_dies_meanwhile_takes_all_of_them_back(bench, profiles, phase):
    if phase == "prepare":
        bench.executors["executor"] = Never()
        bench.start("executor", profiles["swift"])
    bench.client.request(profiles["calm"])
    bench.reach("watch" if phase == "watch" else "prepare")
    if phase == "commit":
        bench.dead.add("planner")
        assert bench.run_until(lambda: bench.client.status["phase"] in ("commit", "rollback"), 60.0)
    bench.dead.add("planner")
    del bench.supervision.members["planner"]
    assert bench.run_until(lambda: bench.client.last, 60.0)
    assert bench.client.last["reason"].startswith("planner ended meanwhile")
    assert bench.supervision.switch.profile == profiles["swift"]
    assert {bench.nodes[name].profile.name for name in NAMES if name != "planner"} == {"swift"}


def test_a_supervisor_that_ends_in_mid_switch_leaves_the_old_choice(bench, profiles):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    assert bench.names() == {"calm"}
    assert bench.choice.load() is None


def test_a_process_that_starts_after_the_switch_gets_the_new_profile(bench, profiles):
    switch = bench.supervision.switch
    assert switch.profile == profiles["swift"]
    bench.client.use(profiles["calm"])
    assert (switch.profile, switch.in_force.name) == (profiles["calm"], "calm")


def test_a_process_that_started_under_a_profile_that_was_rolled_back_is_started_again(
    bench, profiles
):
    stranger = Member(pid=2, started_under=profiles["calm"])
    bench.supervision.members["planner"] = stranger
    bench.tick()
    assert bench.supervision.restarts == ["planner"]


@pytest.mark.parametrize("name", ["planner", "control"])
def test_a_process_that_does_not_confirm_the_way_back_is_started_again(bench, profiles, name):
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.dead.add(name)
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert f"{name} did not go back and is started again" in bench.client.last["reason"]
    bench.tick()
    assert set(bench.supervision.restarts) == {name} - {"control"}, "control is armed"
    bench.state = "disarmed"
    bench.tick()
    bench.tick()
    assert set(bench.supervision.restarts) == {name}


def test_control_is_started_again_only_when_disarmed(bench, profiles):
    bench.tick()
    bench.supervision.members["control"] = Member(pid=2, started_under=profiles["calm"])
    bench.tick()
    assert bench.supervision.restarts == []
    bench.state = "disarmed"
    bench.tick()
    assert bench.supervision.restarts == ["control"]


def restart_on_request(bench: Any, name: str) -> None:
    """Do as the supervisor: end the process, and start it under the profile in force."""
    if name in bench.supervision.restarts:
        bench.supervision.restarts.clear()
        profile = bench.supervision.switch.profile
        bench.start(name, profile)
        bench.supervision.members[name] = Member(pid=2, started_under=profile)


def test_a_process_that_needs_it_is_restarted_when_that_is_allowed(bench, profiles):
    bench.workers["planner"].refusal = NeedsRestart("other threads")
    bench.client.request(profiles["calm"], allow_restart=True)

    def ended() -> bool:
        restart_on_request(bench, "planner")
        return bool(bench.client.last)

    assert bench.run_until(ended, 60.0)
    assert (bench.client.last["outcome"], bench.names()) == ("kept", {"calm"})


def reach_with_restart(bench: Any, name: str, phase: str) -> None:
    """Let `name` be restarted for a change to `calm`, and go on to a phase after that."""
    bench.workers[name].refusal = NeedsRestart("other threads")

    def reached() -> bool:
        restart_on_request(bench, name)
        return bench.client.status.get("phase") == phase

    assert bench.run_until(reached, 60.0)


@pytest.mark.parametrize("phase", ["watch", "judging"])
def test_a_restarted_process_that_dies_takes_all_of_them_back(bench, profiles, phase):
    bench.client.request(profiles["calm"], allow_restart=True)
    reach_with_restart(bench, "planner", "watch")
    if phase == "judging":
        bench.dead.add("planner")
        assert bench.run_until(lambda: bench.client.status["phase"] == "validate", 20.0)
    del bench.supervision.members["planner"]
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "rolled back"
    assert bench.client.last["reason"].startswith("planner ended meanwhile")
    assert {bench.nodes[name].profile.name for name in NAMES if name != "planner"} == {"swift"}
    assert bench.choice.load() is None


def test_a_process_that_dies_before_it_is_to_be_restarted_ends_the_change(bench, profiles):
    bench.supervision = bench.supervise(profiles["swift"], executor=Never())
    bench.workers["planner"].refusal = NeedsRestart("other threads")
    bench.client.request(profiles["calm"], allow_restart=True)
    bench.reach("set power mode")
    bench.supervision.members["planner"] = Member(pid=2, started_under=profiles["swift"])
    assert bench.run_until(lambda: bench.client.last, 5.0)
    assert bench.client.last["reason"].startswith("planner ended meanwhile")
    keeps_swift(bench)


def test_a_restarted_process_that_hangs_is_not_kept(bench, profiles):
    bench.client.request(profiles["calm"], allow_restart=True)
    reach_with_restart(bench, "planner", "watch")
    bench.dead.add("planner")
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "rolled back"
    assert bench.client.last["reason"].startswith("planner: no answer to validate in time")


def test_a_restarted_process_that_is_too_slow_takes_all_of_them_back(bench, profiles):
    bench.client.request(profiles["calm"], allow_restart=True)
    bench.workers["planner"].period_s = 0.001
    reach_with_restart(bench, "planner", "watch")
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "rolled back"
    assert bench.client.last["reason"].startswith("planner: steps at 20.")
    bench.tick()
    assert bench.supervision.restarts == ["planner"], "it runs under the profile that was refused"


def test_a_restarted_process_need_not_be_faster_than_it_was_before(bench, profiles):
    bench.workers["planner"].period_s = 0.03
    assert bench.run_until(lambda: bench.workers["planner"].steps > 1000, 60.0)
    bench.client.request(profiles["calm"], allow_restart=True)
    reach_with_restart(bench, "planner", "watch")
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "kept", "20 Hz of 33 Hz, as before"


def test_a_process_that_came_under_the_old_profile_meanwhile_is_started_again(bench, profiles):
    late = bench.supervision.members.pop("planner")
    bench.client.request(profiles["calm"])
    bench.reach("watch")
    bench.supervision.members["planner"] = late
    assert bench.run_until(lambda: bench.client.last, 20.0)
    assert bench.client.last["outcome"] == "kept"
    bench.tick()
    assert set(bench.supervision.restarts) == {"planner"}


def test_control_is_not_restarted_while_it_is_armed(bench, profiles):
    bench.workers["control"].refusal = NeedsRestart("bus_watchdog_s")
    last = bench.client.use(profiles["calm"], allow_restart=True)
    assert (last["outcome"], last["reason"]) == (
        "refused",
        "control: needs a restart: bus_watchdog_s; disarm first",
    )
    keeps_swift(bench)


def test_a_faulty_profile_never_reaches_a_process(bench, profiles, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('inherits = "desktop"\ncontrol_rate_hz = 5000\n')
    last = bench.client.use(str(path))
    assert last["outcome"] == "refused"
    assert f"{path}: control_rate_hz: expected a number from 50 to 1000 Hz" in last["reason"]
    keeps_swift(bench)


def test_a_profile_for_more_memory_than_there_is_never_reaches_a_process(bench, tmp_path):
    path = tmp_path / "huge.toml"
    path.write_text(
        'inherits = "desktop"\nboard.memory_mb = 250000\nbudgets.total.memory_mb = 240000000e-3\n'
    )
    last = bench.client.use(str(path))
    assert last["outcome"] == "refused"
    assert "that this computer has, got 240000" in last["reason"]


def test_one_change_at_a_time_and_only_when_everyone_is_ready(bench, profiles):
    first = bench.client.request(profiles["calm"])
    bench.reach("watch")
    second = bench.client.use(profiles["swift"])
    assert second["outcome"] == "refused"
    assert "is under way: wait for its end" in second["reason"]
    assert bench.run_until(lambda: bench.client.last["request_id"] == first, 20.0)
    bench.supervision.absent = {"planner": "starting"}
    last = bench.client.use(profiles["swift"])
    assert last["reason"] == "planner is starting: wait until it is ready"


SECTION = "< POWER_MODEL ID={} NAME={} >\nTPC_POWER_GATING TPC_PG_MASK {}\n"


@pytest.fixture
def board(tmp_path: Path) -> PowerSwitch:
    """Describe a board in mode 15W whose nvpmodel does what it is told."""
    modes = ((0, "15W", 0), (1, "25W", 0), (3, "7W", 252))
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/nvpmodel.conf").write_text("".join(SECTION.format(*row) for row in modes))
    status = tmp_path / "var/lib/nvpmodel/status"
    status.parent.mkdir(parents=True)
    status.write_text("pmode:0000\n")
    command = tmp_path / "nvpmodel"
    command.write_text(f'#!/bin/sh\nprintf "pmode:%04d" "$2" > {status}\n')
    command.chmod(0o755)
    return PowerSwitch(tmp_path, [str(command)])


def test_a_run_starts_in_the_mode_of_its_profile(board: PowerSwitch) -> None:
    set_at_start(board, "25W")
    assert board.current() == "25W"


@pytest.mark.parametrize(
    ("mode", "said"), [("7W", "15W -> 7W needs a reboot"), ("40W", "expected one of this board")]
)
def test_a_mode_that_cannot_be_set_is_told_and_left(
    board: PowerSwitch, caplog: pytest.LogCaptureFixture, mode: str, said: str
) -> None:
    set_at_start(board, mode)
    assert said in caplog.text
    assert caplog.text.startswith("WARNING")
    assert board.current() == "15W"


def test_a_profile_without_a_mode_says_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    set_at_start(PowerSwitch(tmp_path), "")
    assert caplog.text == ""
