"""The profile names who plans; what is not there is done without, and told."""

import json

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.ipc import ClaimBook, SharedSpace
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.interfaces import Aid
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot

GO = {"skill": "navigate_to", "place": "kitchen", "yaw_rad": None}
ANSWER = {"reasoning": "", "question": None, "feasible": True, "steps": [GO], "confidence": 0.9}


def test_nobody_else_is_asked_unless_configured(open_with):
    planner = open_with("within_s = 5.0")
    assert planner.back_ends == ("patterns",)
    assert planner.uses == frozenset()


def test_servers_are_asked_after_the_patterns(open_with, loopback, ask):
    planner = open_with('servers = ["bench"]')
    assert planner.back_ends == ("patterns", "server bench")
    assert planner.uses == {Aid.MEMORY}
    assert planner.plan(ask("go to the kitchen")).proposal.back_end == "patterns"
    assert loopback.heard == []
    loopback.then(loopback.says(json.dumps(ANSWER)))
    answer = planner.plan(ask("make it nice in here"))
    assert answer.plan.actions[0].parameters == {"place": "kitchen"}
    assert [one.outcome for one in answer.attempts] == ["declined", "planned"]
    assert planner.document()["servers"][0]["answers"] == 1
    schema = json.dumps(loopback.heard[0].body["response_format"])
    for place in set(world_of(load_robot("butler"), {}).places.values()):
        assert f'"{place}"' in schema


def test_servers_that_are_not_there_are_told_and_done_without(open_with):
    planner = open_with('servers = ["nobody", "cloud", "bench"]')
    assert planner.slow_back_ends == ("server bench",)
    assert set(planner.document()["away"]) == {"nobody", "cloud"}
    assert "no key no_such_key_anywhere" in planner.away["cloud"]


def test_the_shipped_parser_is_asked_last(tmp_path, loopback, ask, profile_of):
    profile = profile_of('servers = ["bench"]')
    planner = planner_for(load_robot("butler"), profile, MonotonicClock(), tmp_path / "base")
    assert planner.slow_back_ends == ("server bench", "command_parser")
    loopback.then(loopback.sends(500, b""))
    answer = planner.plan(ask("would you mind heading over to the kitchen"))
    planner.close()
    assert answer.proposal.back_end == "command_parser"
    assert [one.back_end for one in answer.attempts[1:]] == list(planner.slow_back_ends)


def test_models_on_board_are_done_without_where_others_hold_the_memory(tmp_path):
    clock, run_dir = MonotonicClock(), tmp_path / "base" / "run"
    book = ClaimBook(SharedSpace(run_dir / "ipc", clock), clock)
    book.declare({"ram_mb": 500})
    robot, profile = load_robot("butler"), load_profile("desktop")
    planner = planner_for(robot, profile, clock, tmp_path / "base", run_dir=run_dir)
    assert "command_parser" in planner.back_ends
    (claim,) = book.look().granted
    assert claim.holder.startswith("planner command_parser ")
    planner.close()
    book.ask("perception", {"ram_mb": 500})
    planner = planner_for(robot, profile, clock, tmp_path / "base", run_dir=run_dir)
    assert "command_parser" not in planner.back_ends
    assert "ram_mb is held by perception (500)" in planner.away["command_parser"]
