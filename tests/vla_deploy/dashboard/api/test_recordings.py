"""Flights and recordings are served by name alone; recorder and replay take requests."""

import pytest

from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.telemetry.recording.folder import recordings_dir_of

FLIGHT = "000007-estop.mcap"
RECORDING = "000003-20261122T221500Z-kitchen.mcap"


@pytest.fixture(autouse=True)
def folders(dashboard):
    found = {
        "flights": state_dir_of(dashboard.base) / "flights",
        "recordings": recordings_dir_of(dashboard.base),
    }
    for folder in found.values():
        folder.mkdir(parents=True)
        (folder.parent / "secret").write_text("secret")
        (folder / "000008-link.mcap").symlink_to(folder.parent / "secret")
        (folder / ".000009-half.mcap.part").write_bytes(b"half")
    (found["flights"] / FLIGHT).write_bytes(b"flight")
    (found["recordings"] / RECORDING).write_bytes(b"recording")
    return found


@pytest.mark.parametrize(
    ("kind", "name", "content"),
    [("flights", FLIGHT, b"flight"), ("recordings", RECORDING, b"recording")],
)
def test_a_file_is_listed_and_comes_whole(dashboard, kind, name, content):
    (listed,) = [one for one in dashboard.get(kind) if one["name"] == name]
    assert listed["bytes"] == len(content)
    answer = dashboard.client.get(f"/api/v1/{kind}/{name}")
    assert answer.content == content
    assert answer.headers["content-disposition"] == f'attachment; filename="{name}"'


def test_a_flight_that_goes_while_it_is_listed_is_left_out(dashboard, folders):
    (folders["flights"] / "000010-gone.mcap").symlink_to(folders["flights"] / "nothing")
    names = [one["name"] for one in dashboard.get("flights")]
    assert FLIGHT in names
    assert "000010-gone.mcap" not in names


@pytest.mark.parametrize("kind", ["flights", "recordings"])
@pytest.mark.parametrize(
    "name",
    [
        "../secret",
        "..%2fsecret",
        "%2e%2e%2fsecret",
        "..%252fsecret",
        "%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "000008-link.mcap",
        ".000009-half.mcap.part",
        "latest",
        "7",
        "%00",
        "000007-estop.mcap%00.txt",
        "..\\secret",
    ],
)
def test_no_name_leads_anywhere_else(dashboard, kind, name):
    answer = dashboard.client.get(f"/api/v1/{kind}/{name}")
    assert answer.status_code == 404
    assert b"root:" not in answer.content


def test_a_start_reaches_the_recorder_as_it_was_asked_for(dashboard):
    body = {"topics": ["joint_*"], "without": ["view/*"], "duration_s": 60, "label": "arm"}
    assert dashboard.client.post("/api/v1/recordings", json=body).json() == {"asked": True}
    assert dashboard.robot.hears("recording_request") == [
        {"act": "start", **body, "source": "page"}
    ]


def test_without_a_body_everything_is_recorded_until_a_stop(dashboard):
    assert dashboard.client.post("/api/v1/recordings").status_code == 200
    assert dashboard.client.post("/api/v1/recordings/stop").status_code == 200
    start, stop = dashboard.robot.hears("recording_request")
    assert (start["topics"], start["duration_s"]) == (["*"], None)
    assert stop["act"] == "stop"


@pytest.mark.parametrize(
    "body",
    [
        {"topics": ["no_such_*"]},
        {"topics": []},
        {"topics": ["x" * 61]},
        {"label": "../x"},
        {"duration_s": 0},
        {"duration_s": 1e300},
        {"folder": "/etc"},
    ],
)
def test_what_cannot_be_recorded_is_refused_and_reaches_nobody(dashboard, body):
    answer = dashboard.client.post("/api/v1/recordings", json=body)
    assert answer.status_code == 422
    assert answer.json()["error"]["what"]
    assert dashboard.robot.hears("recording_request") == []


def test_the_status_is_the_recorders_own(dashboard):
    assert dashboard.get("recordings/status") == {"state": "silent"}
    dashboard.robot.shows("recording_status", state="off", refused="", last={})
    assert dashboard.get("recordings/status")["state"] == "off"


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
