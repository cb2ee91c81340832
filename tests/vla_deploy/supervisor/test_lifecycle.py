import pytest

from vla_deploy.supervisor.lifecycle import Act, Record, Seen, State, reconcile
from vla_deploy.supervisor.table import TABLE, ProcessSpec, RestartPolicy

S = 1_000_000_000
POLICY = RestartPolicy(initial_s=1.0, factor=2.0, cap_s=5.0, window_s=100.0, max_restarts=4)
ROWS = tuple(
    ProcessSpec(name=name, command=(), restart=POLICY, ready_timeout_s=10.0, stop_timeout_s=3.0)
    for name in ("a", "b", "c")
)
READY, RUNNING = Seen(ready=True), Seen()


class Play:
    """Drive `reconcile` over a table with a time that only the test moves."""

    def __init__(self, rows=ROWS) -> None:
        self.rows = rows
        self.records = {row.name: Record() for row in rows}
        self.now_s = 0.0

    def step(self, *, stopping: bool = False, **seen: Seen) -> list[tuple[Act, str]]:
        self.records, actions = reconcile(
            self.rows, self.records, seen, stopping=stopping, now_ns=round(self.now_s * S)
        )
        return list(actions)

    def state(self, name: str) -> State:
        return self.records[name].state

    def all_ready(self) -> "Play":
        self.step()
        self.step(a=READY)
        self.step(a=READY, b=READY)
        self.step(a=READY, b=READY, c=READY)
        return self


def test_each_starts_only_when_all_before_it_are_ready():
    play = Play()
    assert play.step() == [(Act.SPAWN, "a")]
    assert play.step(a=RUNNING) == []
    assert play.step(a=READY) == [(Act.SPAWN, "b")]
    assert play.step(a=READY, b=RUNNING) == []
    assert play.step(a=READY, b=READY) == [(Act.SPAWN, "c")]


def test_nothing_is_done_while_all_are_ready():
    play = Play().all_ready()
    assert [play.state(name) for name in "abc"] == [State.READY] * 3
    assert play.step(a=READY, b=RUNNING, c=READY) == []


def test_a_failed_process_is_restarted_after_growing_delays_up_to_the_cap():
    play = Play(ROWS[:1])
    play.step()
    delays = []
    for _ in range(4):
        play.step(a=Seen(exit_code=-9))
        assert play.state("a") is State.BACKOFF
        failed_at = play.now_s
        while not play.step(a=Seen(exit_code=-9)):
            play.now_s += 0.125
        delays.append(play.now_s - failed_at)
        play.step(a=READY)
    assert delays == [1.0, 2.0, 4.0, 5.0]
    assert play.records["a"].restarts == 4


def test_one_failure_more_than_allowed_in_the_window_gives_up_for_good():
    play = Play(ROWS[:1])
    play.step()
    for _ in range(4):
        play.step(a=Seen(exit_code=1))
        play.now_s += 5.0
        assert play.step() == [(Act.SPAWN, "a")]
    play.step(a=Seen(exit_code=1))
    assert play.state("a") is State.GIVEN_UP
    assert play.records["a"].reason == "exit code 1; given up after 5 failures in 100 s"
    play.now_s += 1000
    assert play.step() == []


def test_failures_older_than_the_window_are_forgotten():
    play = Play(ROWS[:1])
    play.step()
    for _ in range(20):
        play.step(a=Seen(exit_code=1))
        play.now_s += 26.0  # four failures within any 100 s
        assert play.step() == [(Act.SPAWN, "a")]


def test_a_configuration_fault_before_it_ever_worked_gives_up_at_once():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=Seen(exit_code=2))
    assert play.state("a") is State.GIVEN_UP


def test_the_same_exit_code_after_it_worked_is_restarted():
    play = Play(ROWS[:1])
    play.step()
    play.step(a=READY)
    play.step(a=Seen(exit_code=2))
    assert play.state("a") is State.BACKOFF


def test_a_process_that_is_not_ready_in_time_is_killed_and_counts_as_failed():
    play = Play(ROWS[:1])
    play.step()
    play.now_s = 9.99
    assert play.step(a=RUNNING) == []
    play.now_s = 10.0
    assert play.step(a=RUNNING) == [(Act.KILL, "a")]
    play.step(a=Seen(exit_code=-9))
    assert play.state("a") is State.BACKOFF
    assert play.records["a"].reason == "not ready within 10 s"


def test_a_restart_waits_for_those_before_it():
    play = Play().all_ready()
    dead = Seen(exit_code=-9)
    play.step(a=dead, b=dead, c=READY)
    play.now_s = 1.0
    assert play.step(a=dead, b=dead, c=READY) == [(Act.SPAWN, "a")]
    assert play.step(a=RUNNING, b=dead, c=READY) == []
    assert play.step(a=READY, b=dead, c=READY) == [(Act.SPAWN, "b")]


def test_one_that_was_given_up_does_not_hold_back_the_restart_of_others():
    play = Play().all_ready()
    play.records["a"] = Record(state=State.GIVEN_UP, was_ready=True)
    play.step(b=Seen(exit_code=1), c=READY)
    play.now_s = 1.0
    assert play.step(c=READY) == [(Act.SPAWN, "b")]


def test_the_last_started_stops_first_and_the_next_waits_for_it():
    play = Play().all_ready()
    dead = Seen(exit_code=0)
    assert play.step(stopping=True, a=READY, b=READY, c=READY) == [(Act.TERMINATE, "c")]
    assert play.step(stopping=True, a=READY, b=READY, c=READY) == []
    assert play.step(stopping=True, a=READY, b=READY, c=dead) == [(Act.TERMINATE, "b")]
    assert play.step(stopping=True, a=READY, b=dead, c=dead) == [(Act.TERMINATE, "a")]
    play.step(stopping=True, a=dead, b=dead, c=dead)
    assert {record.state for record in play.records.values()} == {State.STOPPED}


def test_one_that_does_not_stop_in_time_is_killed():
    play = Play(ROWS[:1])
    play.step()
    assert play.step(stopping=True, a=RUNNING) == [(Act.TERMINATE, "a")]
    play.now_s = 2.99
    assert play.step(stopping=True, a=RUNNING) == []
    play.now_s = 3.0
    assert play.step(stopping=True, a=RUNNING) == [(Act.KILL, "a")]


@pytest.mark.parametrize("state", [State.WAITING, State.BACKOFF, State.GIVEN_UP])
def test_one_that_does_not_run_is_stopped_at_once(state):
    play = Play(ROWS[:1])
    play.records["a"] = Record(state=state)
    assert play.step(stopping=True) == []
    assert play.state("a") is State.STOPPED


def test_the_robots_table_starts_the_twin_first_and_control_before_who_commands_it():
    assert [row.name for row in TABLE] == ["twin", "control", "perception", "planner", "executor"]
    assert [row.name for row in TABLE if row.needs_twin] == ["twin"]
    assert all(row.ready_files or row.ready_topic for row in TABLE)


def test_a_ready_process_that_falls_silent_is_killed_and_started_again_with_that_reason():
    play = Play().all_ready()
    assert play.step(a=READY, b=Seen(silent=True), c=READY) == [(Act.KILL, "b")]
    assert play.step(a=READY, b=Seen(exit_code=-9), c=READY) == []
    assert play.state("b") is State.BACKOFF
    assert play.records["b"].reason == "silent for more than 5 s"
    play.now_s += POLICY.initial_s
    assert play.step(a=READY, c=READY) == [(Act.SPAWN, "b")]
    play.step(a=READY, b=READY, c=READY)
    assert play.records["b"].reason == ""


def test_a_process_that_ends_by_itself_after_a_restart_is_not_called_silent():
    play = Play().all_ready()
    play.step(a=READY, b=Seen(silent=True), c=READY)
    play.step(a=READY, b=Seen(exit_code=-9), c=READY)
    play.now_s += POLICY.initial_s
    play.step(a=READY, c=READY)
    play.step(a=READY, b=Seen(exit_code=1), c=READY)
    assert play.records["b"].reason == "exit code 1"


def test_nothing_is_started_after_one_that_was_given_up_before_it_ever_worked():
    play = Play()
    play.step()
    assert play.step(a=Seen(exit_code=2)) == []
    assert (play.state("a"), play.state("b")) == (State.GIVEN_UP, State.WAITING)
