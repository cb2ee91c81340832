"""Recordings are begun and ended by request, listed and handed out by name alone."""

import pytest

from vla_deploy.telemetry.recording.folder import recordings_dir_of

NAME = "000003-20261122T221500Z-kitchen.mcap"


@pytest.fixture
def folder(dashboard):
    path = recordings_dir_of(dashboard.base)
    path.mkdir(parents=True)
    (path / NAME).write_bytes(b"recording")
    (path.parent / "secret").write_text("secret")
    (path / ".000004-now.mcap.part").write_bytes(b"half")
    return path


def test_a_recording_is_listed_and_comes_whole(dashboard, folder):
    (one,) = dashboard.get("recordings")
    assert (one["name"], one["bytes"]) == (NAME, 9)
    assert dashboard.client.get(f"/api/v1/recordings/{NAME}").content == b"recording"


@pytest.mark.parametrize("name", ["..%2fsecret", "/etc/passwd", ".000004-now.mcap.part", "latest"])
def test_no_name_leads_anywhere_else(dashboard, folder, name):
    assert dashboard.client.get(f"/api/v1/recordings/{name}").status_code == 404


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
