"""What a command topic carries is read by its form alone, and refused in words."""

import json

import pytest

from vla_deploy.gateways.words import (
    OrderInvalid,
    is_mission,
    is_stop_word,
    parsed_plan,
    read_message,
    shown,
)

ACTION = {"action_type": "turn_left", "parameters": {"angle": 20}, "priority": 1}


@pytest.mark.parametrize(
    "data",
    [
        " go to the kitchen\n",
        '{"original_command": "go to the kitchen", "timestamp": 1.5}',
        '{"command": " go to the kitchen "}',
        '{"data": "go to the kitchen"}',
    ],
)
def test_words_are_found(data) -> None:
    message = read_message(data)
    assert (message.text, message.plan) == ("go to the kitchen", None)


@pytest.mark.parametrize(
    ("document", "plan"),
    [
        ([ACTION], [ACTION]),
        ({"goal": "turn", "actions": [ACTION]}, {"goal": "turn", "actions": [ACTION]}),
        ({"plan": {"actions": [ACTION]}}, {"actions": [ACTION]}),
        ({"plan": [ACTION]}, {"plan": [ACTION]}),
    ],
)
def test_plans_are_found(document, plan) -> None:
    message = read_message(json.dumps(document))
    assert (message.text, message.plan) == ("", plan)


def test_a_mission_is_found_by_its_objectives_and_not_taken_for_the_words_of_its_goal() -> None:
    mission = {"goal": "tidy up", "objectives": ["go to the kitchen", {"words": "look left"}]}
    message = read_message(json.dumps(mission))
    assert (message.text, message.plan, message.mission) == ("", None, mission)
    assert not is_mission({"goal": "turn", "actions": [ACTION]})


@pytest.mark.parametrize(
    ("data", "why"),
    [
        ("", "got nothing"),
        (" \n\t ", "got nothing"),
        ("x" * 1001, "at most 1000 characters of words, got 1001"),
        ("x" * 1_000_000, "at most 32000 bytes, got 1000000"),
        ("go\x00", r"U\+0000"),
        ("go \x1b[31m", r"U\+001B"),
        ("go \ud800", r"U\+D800"),
        ("{", "expected JSON, as it begins with '{'"),
        ("[1, 2", "expected JSON, as it begins with '\\['"),
        ('{"actions": [{"distance": NaN}]}', "NaN is no number"),
        ("[" * 20_000, "nested too deeply"),
        ("[]", "empty list"),
        ("{}", "got the keys none"),
        ('{"command": 7, "plan": null}', "got the keys 'command', 'plan'"),
        ('{"command": "go\\u0007"}', r"U\+0007"),
        ('{"command": ""}', "expected words"),
    ],
)
def test_what_is_no_command_is_refused(data, why) -> None:
    with pytest.raises(OrderInvalid, match=why):
        read_message(data)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "the plan is no JSON: Expecting"),
        ('[{"distance": NaN}]', "NaN is no number"),
        ("[" * 20_000, "nested too deeply"),
        ("7", "expected an object or a list, got int"),
    ],
)
def test_what_is_no_plan_is_refused(text, why) -> None:
    with pytest.raises(OrderInvalid, match=why):
        parsed_plan(text)


def test_what_is_shown_is_short_and_plain() -> None:
    assert shown("go\x1b to\n") == "go? to?"
    assert shown("x" * 1000) == "x" * 80 + "..."


@pytest.mark.parametrize(("text", "is_one"), [("Stop!", True), ("halt", True), ("stop it", False)])
def test_bare_words_to_stop_by_are_known(text, is_one) -> None:
    assert is_stop_word(text) is is_one
