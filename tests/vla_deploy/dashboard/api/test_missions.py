"""Missions are given, shown and cancelled by the ring and the cell of the planner."""

import pytest

from vla_deploy.missions.mission import read_mission
from vla_deploy.missions.progress import MissionRun, MissionState

DOCUMENT = {"goal": "tidy up", "objectives": ["go to the kitchen", "find the red cup"]}


def shown(mission_id, state, **changes):
    """Return a mission as the planner shows it."""
    run = MissionRun(
        mission_id=mission_id, mission=read_mission(DOCUMENT | changes), given_unix_s=1.8e9
    )
    run.begin(1.8e9)
    run.state = state
    return run.model_dump(mode="json")


@pytest.mark.parametrize("body", [DOCUMENT, ["go to the kitchen"]], ids=["object", "list"])
def test_a_mission_travels_as_it_is_and_is_noted_by_its_goal(dashboard, body):
    given = dashboard.post("missions", body=body)
    (heard,) = dashboard.robot.hears("utterance")
    assert heard == {"command_id": given["command_id"], "source": "page", "mission": body}
    (entry,) = dashboard.app.state.access.audit.newest(1)
    goal = body["goal"] if isinstance(body, dict) else "mission"
    assert entry["details"] == {"given": given["command_id"], "text": goal}


@pytest.mark.parametrize(
    ("body", "word"),
    [
        ({}, "objectives"),
        ([], "objectives"),
        ({"objectives": [{"wordz": "go"}]}, "wordz"),
        ({"objectives": ["go"], "schedule": {"every_s": 1}}, "every_s"),
        ("go", None),
        (None, None),
        ({"goal": "x" * 70_000, "objectives": ["go"]}, None),
    ],
)
def test_what_is_no_mission_is_refused_with_its_faults_and_never_said(dashboard, body, word):
    error = dashboard.post("missions", status=422, body=body)["error"]
    assert word is None or word in error["what"]
    assert dashboard.robot.hears("utterance") == []


def test_the_newest_missions_are_shown_as_the_planner_shows_them(dashboard):
    assert dashboard.get("missions", status=503)["error"]["code"] == "planner_silent"
    missions = [shown("m2", MissionState.EXECUTING), shown("m1", MissionState.COMPLETED)]
    dashboard.robot.shows("missions", missions=missions, trouble="")
    told = dashboard.get("missions")
    assert [one["mission_id"] for one in told["missions"]] == ["m2", "m1"]
    assert told["missions"][0]["objectives"]["o1"]["state"] == "pending"


def test_one_that_has_not_ended_is_cancelled_by_an_act(dashboard):
    missions = [
        shown("m3", MissionState.EXECUTING),
        shown("m2", MissionState.COMPLETED, schedule={"every_s": 60}),  # it begins again
        shown("m1", MissionState.COMPLETED),
    ]
    dashboard.robot.shows("missions", missions=missions, trouble="")
    ids = [dashboard.post(f"missions/{one}/cancel")["command_id"] for one in ("m3", "m2")]
    heard = dashboard.robot.hears("utterance")
    assert [one["mission_act"] for one in heard] == [{"cancel": "m3"}, {"cancel": "m2"}]
    assert dashboard.get(f"commands/{ids[0]}")["kind"] == "cancel"
    ended = dashboard.post("missions/m1/cancel", status=409)
    assert "already ended: completed" in ended["error"]["what"]
    dashboard.post("missions/m0/cancel", status=404)
    assert dashboard.robot.hears("utterance") == []


def test_a_part_of_a_mission_is_found_by_its_id(dashboard):
    mission = dashboard.post("missions", body=DOCUMENT)["command_id"]
    dashboard.robot.tells(f"{mission}/o1.s1", "accepted")
    told = dashboard.get(f"commands/{mission}/o1.s1")
    assert (told["mission"], told["state"]) == (mission, "active")
