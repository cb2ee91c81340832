"""Follow commands whose other end is played by the test, on a time that passes only by waiting."""

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import attach
from vla_deploy.client.following import ANSWER_TIMEOUT_S, SILENCE_LIMIT_S

PLAN = {
    "actions": [
        {"id": "a1", "skill": "find_object", "parameters": {"object": "cup"}},
        {"id": "a2", "skill": "pick_up", "parameters": {"object": "cup"}},
    ]
}


def action(identity: str, status: str) -> dict:
    return {
        "action_id": identity,
        "skill": "find_object",
        "parameters": {"object": "cup"},
        "status": status,
        "execution_time_s": 0.5,
        "error": None,
        "retries": 0,
    }


def accept(robot, events) -> str:
    """Accept the command, start its first action, and return its id."""
    robot.clock.after_wait = lambda: robot.tell(robot.heard()[-1]["command_id"], "accepted")
    command_id = next(events)["command_id"]
    robot.tell(command_id, "plan", plan=PLAN)
    robot.tell(command_id, "action", **action("a1", "active"))
    robot.clock.after_wait = lambda: robot.executes(command_id)
    assert [next(events)["event"] for _ in range(2)] == ["plan", "action"]
    return command_id


def test_a_command_is_followed_to_its_end_past_the_events_of_others(session, robot):
    events = session.command(text="find the cup")
    command_id = accept(robot, events)
    robot.tell("somebody-else", "finished", success=False, error="theirs", actions=[])
    robot.tell(command_id, "finished", success=True, error=None, actions=[])
    (last,) = events
    assert (last["command_id"], last["success"]) == (command_id, True)


def test_each_command_has_an_id_of_its_own(session, robot):
    session.command(text="one")
    session.command(text="two")
    one, two = robot.heard()
    assert (one["text"], two["text"]) == ("one", "two")
    assert one["command_id"] != two["command_id"]


def test_a_command_that_nobody_answers_fails_in_time_and_says_what_to_do(session, robot):
    started_s = robot.clock.now_s
    with pytest.raises(CommandFailed, match=r"no answer .*vla-deploy status.*vla-deploy estop"):
        list(session.command(text="find the cup"))
    assert robot.clock.now_s - started_s == pytest.approx(ANSWER_TIMEOUT_S, abs=0.1)


def test_a_command_whose_executor_falls_silent_is_told_as_lost(session, robot):
    events = session.command(text="find the cup")
    accept(robot, events)
    next_events_s = robot.clock.now_s
    robot.clock.after_wait = lambda: None
    (last,) = events
    assert last["success"] is False
    assert last["error"].startswith("lost: the executor has not spoken of the command for 5 s")
    assert [one["status"] for one in last["actions"]] == ["lost", "lost"]
    assert robot.clock.now_s - next_events_s < SILENCE_LIMIT_S + 1.5


def test_a_command_whose_executor_was_replaced_is_lost_at_once(session, robot, monkeypatch):
    events = session.command(text="find the cup")
    accept(robot, events)
    at_work = session.fresh("executor_status")
    # One poll sees the executor at work; the next sees its successor, idle and with another pid.
    seen = iter([at_work, _successor_of(at_work)])
    monkeypatch.setattr(type(session), "fresh", lambda *_, **__: next(seen))
    started_s = robot.clock.now_s
    (last,) = events
    assert "the executor ended while it had the command" in last["error"]
    assert robot.clock.now_s - started_s < 0.5


def _successor_of(sample):
    class Successor:
        writer_pid = sample.writer_pid + 1

        @staticmethod
        def document() -> dict:
            return {"commands": []}

    return Successor()


def test_the_end_of_a_command_is_seen_even_when_its_executor_ended_right_after(session, robot):
    events = session.command(text="find the cup")
    command_id = accept(robot, events)
    robot.tell(command_id, "finished", success=True, error=None, actions=[])
    robot.clock.after_wait = lambda: None
    robot.clock.time_ns += 60_000_000_000
    (last,) = events
    assert last["success"] is True


def test_a_command_may_be_planned_for_long_while_the_planner_names_it(session, robot):
    events = session.command(text="tidy up")
    command_id = robot.heard()[-1]["command_id"]
    robot.tell(command_id, "planning", rungs=["server bench"])
    robot.clock.after_wait = lambda: robot.plans(command_id)
    assert next(events)["event"] == "planning"
    robot.clock.time_ns += 15 * NS_PER_S
    robot.tell(command_id, "plan", plan=PLAN)
    assert next(events)["event"] == "plan"


def test_a_command_that_the_planner_forgot_is_told_as_lost(session, robot):
    events = session.command(text="tidy up")
    command_id = robot.heard()[-1]["command_id"]
    robot.tell(command_id, "planning", rungs=["server bench"])
    (planning, last) = events
    assert planning["event"] == "planning"
    assert last["error"].startswith("lost: the planner has not spoken of the command for 5 s")


def test_an_answer_follows_the_command_that_asked(session, robot):
    events = session.command(text="the red one", answer=True)
    (given,) = robot.heard()
    assert given["answer"] is True
    robot.tell(given["command_id"], "answered", of="c9")
    robot.tell("c9", "accepted")
    robot.tell("c9", "finished", success=True, error=None, actions=[])
    assert [one["event"] for one in events] == ["answered", "accepted", "finished"]


def test_a_cell_that_is_too_old_counts_as_none(session, robot):
    assert session.document("executor_status") is None
    robot.executes(None)
    assert session.document("executor_status", age_limit_s=1.0)["state"] == "idle"
    robot.clock.time_ns += 1_000_000_001
    assert session.document("executor_status", age_limit_s=1.0) is None
    assert session.document("executor_status")["state"] == "idle"


def test_attaching_where_nothing_runs_says_how_to_start_it(tmp_path):
    with pytest.raises(UsageError, match=r"no robot runs in .*; start one: vla-deploy run --twin"):
        attach(tmp_path / "nowhere")
