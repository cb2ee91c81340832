from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.runtime.exit_codes import EXIT_DEVICE_ABSENT
from vla_deploy.supervisor.processes.lifecycle import (
    ABORT_GRACE_NS,
    ProcessAct,
    ProcessRecord,
    ProcessSeen,
    ProcessState,
    is_settled,
    reconcile,
    wind_down,
)
from vla_deploy.supervisor.systemd import give_up_s
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec, RestartPolicy, twin_only

S = 1_000_000_000
POLICY = RestartPolicy(initial_s=1.0, factor=2.0, cap_s=5.0, max_restarts=4)
ROWS = tuple(
    ProcessSpec(name=name, command=(), restart=POLICY, ready_timeout_s=10.0, stop_timeout_s=3.0)
    for name in ("a", "b", "c")
)
TOGETHER = (
    ROWS[0],
    ROWS[1],
    replace(ROWS[2], with_previous=True),
    replace(ROWS[2], name="d"),
)
READY, RUNNING = ProcessSeen(ready=True), ProcessSeen()


class Play:
    """Drive `reconcile` over a table with a time that only the test moves."""

    def __init__(self, rows=ROWS) -> None:
        self.rows = rows
        self.records = {row.name: ProcessRecord() for row in rows}
        self.now_s = 0.0

    def step(self, *, unwanted=(), **seen: ProcessSeen) -> list[tuple[ProcessAct, str]]:
        reasons = dict.fromkeys(unwanted, "not now")
        self.records, actions = reconcile(
            self.rows, self.records, seen, unwanted=reasons, now_ns=round(self.now_s * S)
        )
        return list(actions)

    def stop(self, **seen: ProcessSeen) -> list[tuple[ProcessAct, str]]:
        self.records, actions = wind_down(
            self.rows, self.records, seen, now_ns=round(self.now_s * S)
        )
        return list(actions)

    def state(self, name: str) -> ProcessState:
        return self.records[name].state

    def all_ready(self) -> "Play":
        self.step()
        self.step(a=READY)
        self.step(a=READY, b=READY)
        self.step(a=READY, b=READY, c=READY)
        return self


def test_each_starts_only_when_all_before_it_are_ready():
    play = Play()
    assert play.step() == [(ProcessAct.SPAWN, "a")]
    assert play.step(a=RUNNING) == []
    assert play.step(a=READY) == [(ProcessAct.SPAWN, "b")]
    assert play.step(a=READY, b=RUNNING) == []
    assert play.step(a=READY, b=READY) == [(ProcessAct.SPAWN, "c")]


def test_rows_that_go_together_start_together_and_later_rows_wait_for_all_of_them():
    play = Play(TOGETHER)
    assert play.step() == [(ProcessAct.SPAWN, "a")]
    assert play.step(a=RUNNING) == []
    assert play.step(a=READY) == [(ProcessAct.SPAWN, "b"), (ProcessAct.SPAWN, "c")]
    assert play.step(a=READY, b=RUNNING, c=READY) == []
    assert play.step(a=READY, b=READY, c=RUNNING) == [(ProcessAct.SPAWN, "d")]


def test_rows_that_go_together_wait_for_those_before_them_even_if_the_first_is_not_wanted():
    play = Play(TOGETHER)
    assert play.step(unwanted="b") == [(ProcessAct.SPAWN, "a")]
    assert play.step(unwanted="b", a=RUNNING) == []
    assert play.step(unwanted="b", a=READY) == [(ProcessAct.SPAWN, "c")]


def test_one_that_failed_does_not_hold_back_who_goes_with_it():
    play = Play(TOGETHER)
    play.step()
    play.step(a=READY)
    play.step(a=READY, b=READY, c=READY)
    assert play.step(a=READY, b=ProcessSeen(exit_code=1), c=ProcessSeen(exit_code=1), d=READY) == []
    play.records["b"] = ProcessRecord(state=ProcessState.BACKOFF, until_ns=9 * S, was_ready=True)
    play.now_s = 8.0
    assert play.step(a=READY, d=READY) == [(ProcessAct.SPAWN, "c")]


def test_nothing_is_done_while_all_are_ready():
    play = Play().all_ready()
    assert [play.state(name) for name in "abc"] == [ProcessState.READY] * 3
    assert play.step(a=READY, b=RUNNING, c=READY) == []


def test_a_failed_process_is_restarted_after_growing_delays_up_to_the_cap():
    play = Play(ROWS[:1])
    play.step()
    delays = []
    for _ in range(4):
        play.step(a=ProcessSeen(exit_code=-9))
        assert play.state("a") is ProcessState.BACKOFF
        failed_at = play.now_s
        while not play.step(a=ProcessSeen(exit_code=-9)):
            play.now_s += 0.125
        delays.append(play.now_s - failed_at)
        play.step(a=READY)
    assert delays == [1.0, 2.0, 4.0, 5.0]
    assert play.records["a"].restarts == 4


def test_one_failure_more_than_allowed_in_a_row_gives_up_for_good():
    play = Play(ROWS[:1])
    play.step()
    for _ in range(4):
        play.step(a=ProcessSeen(exit_code=1))
        play.now_s += 5.0
        assert play.step() == [(ProcessAct.SPAWN, "a")]
    play.step(a=ProcessSeen(exit_code=1))
    assert play.state("a") is ProcessState.GIVEN_UP
    reason = "exit code 1; given up after 5 failures, never 30 s in order"
    assert play.records["a"].reason == reason
    play.now_s += 1000
    assert play.step() == []


def fail_until_given_up(row: ProcessSpec, *, hangs: bool) -> tuple[int, float]:
    """Let a row fail as slowly as it can; return how often it did, and after what time it ended."""
    play, failures = Play((replace(row, with_previous=False),)), 0
    limits_s = [watched.silence_limit_s or 0.0 for watched in row.watched]
    while play.state(row.name) is not ProcessState.GIVEN_UP and failures < 100:
        assert play.step() == [(ProcessAct.SPAWN, row.name)]
        if hangs:
            play.step(**{row.name: READY})
            play.now_s += max(limits_s)
            assert play.step(**{row.name: ProcessSeen(silence="silent")}) == [
                (ProcessAct.ABORT, row.name)
            ]
        else:
            play.now_s += row.ready_timeout_s
            assert play.step(**{row.name: RUNNING}) == [(ProcessAct.ABORT, row.name)]
        play.now_s += ABORT_GRACE_NS / S
        play.step(**{row.name: ProcessSeen(exit_code=-9)})
        failures += 1
        play.now_s = max(play.now_s, play.records[row.name].until_ns / S)
    return failures, play.now_s


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
@pytest.mark.parametrize("hangs", [False, True], ids=["never ready", "hangs once ready"])
def test_every_row_of_the_robots_table_is_given_up_however_slowly_it_fails(row, hangs):
    failures, after_s = fail_until_given_up(row, hangs=hangs)
    assert failures == row.restart.max_restarts + 1
    assert after_s <= give_up_s(row)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
@pytest.mark.parametrize("every_s", [180.0, 3 * 86400.0], ids=["minutes", "days"])
def test_no_row_of_the_robots_table_is_given_up_for_failures_between_stable_runs(row, every_s):
    play = Play((replace(row, with_previous=False),))
    for _ in range(40):
        assert play.step() == [(ProcessAct.SPAWN, row.name)]
        play.now_s += 5.0
        play.step(**{row.name: READY})
        play.now_s += every_s
        play.step(**{row.name: READY})
        play.step(**{row.name: ProcessSeen(exit_code=-9)})
        assert play.state(row.name) is ProcessState.BACKOFF
        play.now_s += row.restart.initial_s


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_one_that_fails_again_and_again_between_stable_runs_is_given_up(row):
    play, failures = Play((replace(row, with_previous=False),)), 0
    while play.state(row.name) is not ProcessState.GIVEN_UP:
        assert failures <= row.restart.most_in_window
        play.step()
        play.step(**{row.name: READY})
        play.now_s += row.restart.stable_s
        play.step(**{row.name: READY})
        assert play.records[row.name].failures == 0
        play.step(**{row.name: ProcessSeen(exit_code=-9)})
        failures += 1
        play.now_s += row.restart.initial_s

    assert failures == row.restart.most_in_window + 1
    assert f"given up after {failures} failures in 363 s" in play.records[row.name].reason


def test_one_that_the_computer_cannot_start_is_tried_again_and_given_up_like_any_other():
    play = Play(ROWS[:1])
    refused = ProcessSeen(refused="[Errno 11] Resource temporarily unavailable")
    for _ in range(POLICY.max_restarts):
        assert play.step(a=refused) == [(ProcessAct.SPAWN, "a")]
        play.step(a=refused)
        assert play.state("a") is ProcessState.BACKOFF
        assert play.records["a"].reason == f"could not be started: {refused.refused}"
        play.now_s += POLICY.cap_s
    play.step(a=refused)
    play.step(a=refused)
    assert (play.state("a"), play.records["a"].exit_code) == (ProcessState.GIVEN_UP, None)


def test_one_that_could_not_be_started_stops_at_once():
    play = Play(ROWS[:1])
    play.step()
    assert play.stop(a=ProcessSeen(refused="[Errno 12] Cannot allocate memory")) == []
    assert play.state("a") is ProcessState.STOPPED


def test_a_configuration_fault_before_it_ever_worked_gives_up_at_once():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=ProcessSeen(exit_code=2))
    assert play.state("a") is ProcessState.GIVEN_UP


def test_an_absent_device_is_looked_for_again_also_before_it_ever_worked():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=ProcessSeen(exit_code=EXIT_DEVICE_ABSENT))
    assert play.state("a") is ProcessState.BACKOFF
    assert play.records["a"].reason == "a device is absent: exit code 4"


def test_the_same_exit_code_after_it_worked_is_restarted():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=READY)
    play.step(a=ProcessSeen(exit_code=2))
    assert play.state("a") is ProcessState.BACKOFF


def test_a_process_that_is_not_ready_in_time_is_killed_and_counts_as_failed():
    play = Play(ROWS[:1])
    play.step()
    play.now_s = 9.99
    assert play.step(a=RUNNING) == []
    play.now_s = 10.0
    assert play.step(a=RUNNING) == [(ProcessAct.ABORT, "a")]
    play.step(a=ProcessSeen(exit_code=-6))
    assert play.state("a") is ProcessState.BACKOFF
    assert play.records["a"].reason == "not ready within 10 s"


def test_a_restart_waits_for_those_before_it():
    play = Play().all_ready()
    dead = ProcessSeen(exit_code=-9)
    play.step(a=dead, b=dead, c=READY)
    play.now_s = 1.0
    assert play.step(a=dead, b=dead, c=READY) == [(ProcessAct.SPAWN, "a")]
    assert play.step(a=RUNNING, b=dead, c=READY) == []
    assert play.step(a=READY, b=dead, c=READY) == [(ProcessAct.SPAWN, "b")]


def test_one_that_was_given_up_does_not_hold_back_the_restart_of_others():
    play = Play().all_ready()
    play.records["a"] = ProcessRecord(state=ProcessState.GIVEN_UP, was_ready=True)
    play.step(b=ProcessSeen(exit_code=1), c=READY)
    play.now_s = 1.0
    assert play.step(c=READY) == [(ProcessAct.SPAWN, "b")]


def test_the_last_started_stops_first_and_the_next_waits_for_it():
    play = Play().all_ready()
    dead = ProcessSeen(exit_code=0)
    assert play.stop(a=READY, b=READY, c=READY) == [(ProcessAct.TERMINATE, "c")]
    assert play.stop(a=READY, b=READY, c=READY) == []
    assert play.stop(a=READY, b=READY, c=dead) == [(ProcessAct.TERMINATE, "b")]
    assert play.stop(a=READY, b=dead, c=dead) == [(ProcessAct.TERMINATE, "a")]
    play.stop(a=dead, b=dead, c=dead)
    assert {record.state for record in play.records.values()} == {ProcessState.STOPPED}


def test_rows_that_go_together_stop_together_and_earlier_rows_wait_for_all_of_them():
    play = Play(TOGETHER)
    ready, dead = dict.fromkeys("abcd", READY), ProcessSeen(exit_code=0)
    for seen in ({}, {"a": READY}, {"a": READY, "b": READY, "c": READY}, ready):
        play.step(**seen)
    assert play.stop(**ready) == [(ProcessAct.TERMINATE, "d")]
    assert play.stop(**ready) == []
    assert play.stop(**ready | {"d": dead}) == [
        (ProcessAct.TERMINATE, "c"),
        (ProcessAct.TERMINATE, "b"),
    ]
    assert play.stop(**ready | {"d": dead, "b": dead}) == []
    assert play.stop(**ready | {"d": dead, "b": dead, "c": dead}) == [(ProcessAct.TERMINATE, "a")]


def test_one_that_does_not_stop_in_time_is_killed():
    play = Play(ROWS[:1])
    play.step()
    assert play.stop(a=RUNNING) == [(ProcessAct.TERMINATE, "a")]
    play.now_s = 2.99
    assert play.stop(a=RUNNING) == []
    play.now_s = 3.0
    assert play.stop(a=RUNNING) == [(ProcessAct.KILL, "a")]


@pytest.mark.parametrize(
    "state", [ProcessState.WAITING, ProcessState.BACKOFF, ProcessState.GIVEN_UP]
)
def test_one_that_does_not_run_is_stopped_at_once(state):
    play = Play(ROWS[:1])
    play.records["a"] = ProcessRecord(state=state)
    assert play.stop() == []
    assert play.state("a") is ProcessState.STOPPED


def test_the_robots_table_starts_the_twin_first_and_control_before_who_commands_it():
    assert [row.name for row in TABLE] == [
        "twin",
        "control",
        "stop_door",
        "perception",
        "speech",
        "planner",
        "executor",
        "recorder",
        "dashboard",
        "ros",
    ]
    assert [row.name for row in TABLE if row.when is twin_only] == ["twin"]
    assert all(row.ready_files or row.ready_topic for row in TABLE)
    together = [row.name for row in TABLE if row.with_previous]
    assert together == [
        *("stop_door", "speech", "planner", "executor", "recorder", "dashboard", "ros"),
    ]


def test_a_ready_process_that_falls_silent_is_aborted_and_started_again_with_that_reason():
    play = Play().all_ready()
    assert play.step(a=READY, b=ProcessSeen(silence="scene silent"), c=READY) == [
        (ProcessAct.ABORT, "b")
    ]
    assert play.state("b") is ProcessState.ABORTING
    assert play.step(a=READY, b=ProcessSeen(exit_code=-6), c=READY) == []
    assert play.state("b") is ProcessState.BACKOFF
    assert play.records["b"].reason == "scene silent"
    play.now_s += POLICY.initial_s
    assert play.step(a=READY, c=READY) == [(ProcessAct.SPAWN, "b")]
    play.step(a=READY, b=READY, c=READY)
    assert play.records["b"].reason == ""


def test_one_that_does_not_end_when_aborted_is_killed_after_a_second():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=READY)
    play.step(a=ProcessSeen(silence="scene silent"))
    play.now_s = 0.99
    assert play.step(a=RUNNING) == []
    play.now_s = 1.0
    assert play.step(a=RUNNING) == [(ProcessAct.KILL, "a")]
    play.step(a=ProcessSeen(exit_code=-9))
    assert (play.state("a"), play.records["a"].reason) == (ProcessState.BACKOFF, "scene silent")


def test_a_process_that_ends_by_itself_after_a_restart_is_not_called_silent():
    play = Play().all_ready()
    play.step(a=READY, b=ProcessSeen(silence="scene silent"), c=READY)
    play.step(a=READY, b=ProcessSeen(exit_code=-6), c=READY)
    play.now_s += POLICY.initial_s
    play.step(a=READY, c=READY)
    play.step(a=READY, b=ProcessSeen(exit_code=1), c=READY)
    assert play.records["b"].reason == "exit code 1"


def test_after_a_stable_run_earlier_failures_are_forgotten():
    play = Play(ROWS[:1])
    play.step()
    for _ in range(12):  # far more than are allowed in a row, each after a stable run
        play.step(a=READY)
        play.now_s += POLICY.stable_s
        play.step(a=READY)
        assert play.records["a"].failures == 0
        play.step(a=ProcessSeen(exit_code=1))
        play.now_s += POLICY.initial_s
        assert play.step() == [(ProcessAct.SPAWN, "a")]


def test_a_moment_less_than_a_stable_run_forgets_nothing():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=ProcessSeen(exit_code=1))
    play.now_s += POLICY.initial_s
    play.step()
    play.step(a=READY)
    play.now_s += POLICY.stable_s - 0.001
    play.step(a=READY)
    assert play.records["a"].failures == 1


def test_what_is_not_wanted_is_not_started_and_holds_nobody_up():
    play = Play()
    assert play.step(unwanted="a") == [(ProcessAct.SPAWN, "b")]
    assert (play.state("a"), play.records["a"].reason) == (ProcessState.OFF, "not now")


def test_what_is_no_longer_wanted_stops_in_order_the_last_first():
    play = Play().all_ready()
    assert play.step(unwanted="bc", a=READY, b=READY, c=READY) == [(ProcessAct.TERMINATE, "c")]
    assert play.step(unwanted="bc", a=READY, b=READY, c=READY) == []
    ended = ProcessSeen(exit_code=0)
    assert play.step(unwanted="bc", a=READY, b=READY, c=ended) == [(ProcessAct.TERMINATE, "b")]
    play.step(unwanted="bc", a=READY, b=ended, c=ended)
    assert [play.state(name) for name in "abc"] == [
        ProcessState.READY,
        ProcessState.OFF,
        ProcessState.OFF,
    ]


def test_what_is_wanted_again_starts_again_and_counts_as_no_failure():
    play = Play().all_ready()
    play.step(unwanted="c", a=READY, b=READY, c=READY)
    play.step(unwanted="c", a=READY, b=READY, c=ProcessSeen(exit_code=0))
    assert play.step(a=READY, b=READY, c=ProcessSeen(exit_code=0)) == [(ProcessAct.SPAWN, "c")]
    assert (play.records["c"].restarts, play.records["c"].failures) == (0, 0)


def test_what_is_wanted_again_while_it_stops_ends_first():
    play = Play().all_ready()
    play.step(unwanted="c", a=READY, b=READY, c=READY)
    assert play.step(a=READY, b=READY, c=READY) == []
    play.step(a=READY, b=READY, c=ProcessSeen(exit_code=0))
    assert play.step(a=READY, b=READY) == [(ProcessAct.SPAWN, "c")]


def test_a_change_of_mind_does_not_revive_what_was_given_up():
    play = Play(ROWS[:1])
    play.records["a"] = ProcessRecord(
        state=ProcessState.GIVEN_UP, was_ready=True, reason="exit code 1"
    )
    play.step(unwanted="a")
    play.step()
    assert (play.state("a"), play.records["a"].reason) == (ProcessState.GIVEN_UP, "exit code 1")


def test_what_all_can_do_without_holds_nobody_back_once_it_is_given_up():
    play = Play((replace(ROWS[0], giving_up=GivingUp.CARRY_ON), ROWS[1]))
    play.records["a"] = ProcessRecord(state=ProcessState.GIVEN_UP, reason="exit code 2")
    assert play.step(a=ProcessSeen(exit_code=2)) == [(ProcessAct.SPAWN, "b")]


def test_nothing_is_started_after_one_that_was_given_up_before_it_ever_worked():
    play = Play()
    play.step()
    assert play.step(a=ProcessSeen(exit_code=2)) == []
    assert (play.state("a"), play.state("b")) == (ProcessState.GIVEN_UP, ProcessState.WAITING)


def test_a_table_is_settled_when_whoever_should_run_is_ready() -> None:
    def table(*states: ProcessState) -> dict[str, Any]:
        return {"processes": [{"state": state.value} for state in states]}

    assert is_settled(table(ProcessState.READY, ProcessState.OFF))
    assert not is_settled(table(ProcessState.READY, ProcessState.STARTING))
    assert not is_settled(table(ProcessState.GIVEN_UP))
    assert not is_settled(table())
