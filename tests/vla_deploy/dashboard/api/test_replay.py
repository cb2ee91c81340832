"""A page winds the replay that it shows; where a robot runs there is nothing to wind."""

import pytest

ACTS = [
    {"act": "pause", "value": 0.0},
    {"act": "resume", "value": 0.0},
    {"act": "seek", "value": 12.5},
    {"act": "speed", "value": 4.0},
]


@pytest.fixture
def shown(dashboard):
    dashboard.robot.shows("replay_status", file="run.mcap", state="playing")
    return dashboard


@pytest.mark.parametrize("act", ACTS)
def test_what_is_asked_reaches_the_replay(shown, act):
    assert shown.post("replay", 200, act) == {"asked": True}
    assert shown.robot.hears("replay_request") == [act]


def test_beside_a_robot_it_is_refused_and_reaches_nobody(dashboard):
    error = dashboard.post("replay", 409, {"act": "pause"})["error"]
    assert error["code"] == "no_replay"
    assert dashboard.robot.hears("replay_request") == []


@pytest.mark.parametrize(
    "act",
    [
        {"act": "arm"},
        {"act": "seek", "value": -1},
        {"act": "seek", "value": 1e300},
        {"act": "speed", "value": "fast"},
        {"act": "pause", "file": "/etc/passwd"},
        {},
    ],
)
def test_anything_else_is_refused_by_its_form(shown, act):
    shown.post("replay", 422, act)
    assert shown.robot.hears("replay_request") == []
