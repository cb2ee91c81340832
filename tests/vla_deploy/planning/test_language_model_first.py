"""A language model is asked before the parser, and checks what patterns make of scope words."""

import json
from typing import Any

import pytest

from vla_deploy.planning.dialogue.confirmation import confirmation_of
from vla_deploy.planning.planner import Planner

NICE = "make it nice in here"
BOTH = "pick up both cups"
KITCHEN = {"skill": "navigate_to", "place": "kitchen", "yaw_rad": None}
RED = {"skill": "pick_up", "object": "red cup", "arm": None}
BLUE = {"skill": "pick_up", "object": "blue cup", "arm": None}
LOOK = {"skill": "look_at", "object": "red cup"}
TO_HALL = ("navigate_to", {"place": "hall"})
NO_WAY = {"steps": [], "feasible": False, "reasoning": "I cannot reach it"}
DOUBT = 'You said "both", which I may not have understood. Shall I pick up the red cup and pick up'


def says(*steps: dict[str, Any], **changes: Any) -> str:
    told = {"reasoning": "so", "question": None, "feasible": True, "confidence": 0.95}
    return json.dumps(told | {"steps": list(steps)} | changes)


@pytest.fixture
def parser(back_end, propose):
    return back_end("parser", propose(TO_HALL, back_end="parser", covers=None))


@pytest.fixture
def planner(open_with, parser):
    """Open a planner whose profile names a server, beside a parser on board."""

    def planner(within_s: float = 5.0, **changes: str) -> Planner:
        return open_with(f'servers = ["bench"]\nwithin_s = {within_s}', parser, **changes)

    return planner


def outcomes(answer) -> list[tuple[str, str]]:
    return [(one.back_end, one.outcome) for one in answer.attempts]


def test_the_server_plans_and_the_parser_is_not_asked(planner, loopback, parser, ask) -> None:
    loopback.then(loopback.says(says(KITCHEN)))
    asked = planner()
    assert asked.back_ends == ("patterns", "server bench", "parser")
    assert asked.plan(ask(NICE)).proposal.back_end == "server bench"
    assert parser.asked == []


@pytest.mark.parametrize("text", ["no JSON", says(KITCHEN, place="narnia")])
def test_a_server_that_has_no_plan_is_followed_by_the_parser(
    planner, loopback, ask, text: str
) -> None:
    loopback.then(loopback.says(text.replace('"kitchen"', '"narnia"')))
    answer = planner().plan(ask(NICE))
    assert (answer.proposal.back_end, answer.proposal.is_read_back) == ("parser", False)
    assert [name for name, _ in outcomes(answer)[1:]] == ["server bench", "parser"]


def test_a_server_that_is_away_or_late_leaves_time_for_the_parser(planner, loopback, ask) -> None:
    away = planner(url="http://127.0.0.1:9").plan(ask(NICE))
    assert outcomes(away)[1:] == [("server bench", "declined"), ("parser", "planned")]
    loopback.then(loopback.raw(b"HTTP/1.1 200 OK\r\n", pause_s=0.8))
    late = planner(within_s=1.0).plan(ask(NICE))
    assert outcomes(late)[1:] == [("server bench", "late"), ("parser", "planned")]


def test_a_server_may_take_all_the_time_but_what_the_parser_needs(
    clock, back_end, propose, ask
) -> None:
    model = back_end("model", propose(TO_HALL), takes_s=17.0)
    model.is_language_model = True
    planner = Planner(clock, (back_end("parser", propose(TO_HALL)), model), within_s=20.0)
    assert planner.plan(ask(NICE)).proposal.plan == propose(TO_HALL).plan
    assert planner.back_ends[1:] == ("model", "parser")


@pytest.mark.parametrize(
    ("text", "asks"),
    [("make it nice, except the hall", True), ("make it nice in the hall", False)],
)
def test_what_a_server_finds_impossible_is_asked_about_where_words_change_the_scope(
    planner, loopback, ask, text: str, *, asks: bool
) -> None:
    loopback.then(loopback.says(says(**NO_WAY)))
    answer = planner().plan(ask(text))
    assert answer.proposal.back_end == "parser"
    assert answer.proposal.is_read_back is asks


@pytest.mark.parametrize("steps", [(RED, BLUE), (BLUE, RED), (RED, BLUE, LOOK)])
def test_a_plan_that_a_server_shares_runs_unasked(planner, loopback, ask, steps) -> None:
    loopback.then(loopback.says(says(*steps)))
    answer = planner().plan(ask(BOTH))
    assert outcomes(answer) == [("patterns", "planned"), ("server bench", "planned")]
    assert (answer.proposal.back_end, answer.proposal.is_read_back) == ("patterns", False)


@pytest.mark.parametrize(
    "text",
    [
        says(RED),
        says(RED, BLUE, KITCHEN),
        says(KITCHEN),
        says(**NO_WAY),
        says(question="Which two?"),
        says(KITCHEN | {"place": "narnia"}),
    ],
)
def test_a_plan_that_a_server_does_not_share_is_read_back(planner, loopback, ask, text) -> None:
    loopback.then(loopback.says(text))
    request = ask(BOTH)
    answer = planner().plan(request)
    assert confirmation_of(answer.plan, request, answer.proposal).startswith(DOUBT)
    assert answer.proposal.back_end == "patterns"
    assert [one.skill for one in answer.plan.actions].count("pick_up") == 2


def test_a_plan_stands_where_no_server_can_check_it(planner, ask) -> None:
    answer = planner(url="http://127.0.0.1:9").plan(ask(BOTH))
    assert outcomes(answer) == [("patterns", "planned"), ("server bench", "declined")]
    assert not answer.proposal.is_read_back


def test_what_moves_nothing_is_not_checked(planner, loopback, ask) -> None:
    asked = planner()
    assert asked.plan(ask("don't touch the keys")).proposal.back_end == "patterns"
    assert loopback.heard == []


def test_a_check_is_made_outside_the_steps_and_a_stop_overtakes_it(
    open_desk, later, back_end, propose
) -> None:
    model = back_end("model", propose(TO_HALL))
    model.is_language_model = True
    desk = open_desk(model, executor=later)
    desk.sees("red cup_1", "blue cup_2")
    assert [one["event"] for one in desk.answers_to(BOTH)] == ["planning"]
    later.do_one()
    (asked,) = desk.answers()
    assert asked["question"].startswith(DOUBT)
    assert desk.plans() == []
    assert [one["event"] for one in desk.answers_to("yes")] == ["answered", "accepted", "plan"]
    desk.answers_to(BOTH)
    assert [one["command_id"] for one in desk.answers_to("stop")] == ["c3"]
    later.do_one()
    assert desk.answers() == []
    assert desk.plans()[1:] == [{"command_id": "c4", "cancel": True}]
