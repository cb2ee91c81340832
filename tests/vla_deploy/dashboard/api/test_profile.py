"""The profile in force, those that there are, their differences, and a switch."""

from urllib.parse import quote

import pytest


@pytest.fixture
def on_desktop(dashboard):
    dashboard.robot.shows("profile_status", profile="desktop", begun_with="desktop")
    return dashboard


def test_the_profiles_of_this_computer_are_told(on_desktop):
    told = on_desktop.get("profile")
    assert told["current"]["profile"] == "desktop"
    names = [one["name"] for one in told["available"]]
    assert "jetson_thor" in names
    assert not any(name.endswith("base") for name in names)
    assert told["detected"]["why"]


def test_a_difference_names_what_would_change(on_desktop):
    keys = on_desktop.get("profile/jetson_thor/difference")["keys"]
    assert keys["board.cpu_count"] == {"current": 4, "wanted": 12}
    assert on_desktop.get("profile/desktop/difference")["keys"] == {}


def test_without_a_supervisor_nothing_is_compared(dashboard):
    assert dashboard.get("profile/desktop/difference", status=503)["error"]["code"] == "no_profile"


def test_a_profile_in_force_whose_file_is_gone_is_told(dashboard):
    gone = "/etc/vla-deploy/gone.toml"
    dashboard.robot.shows("profile_status", profile=gone, begun_with="desktop")
    error = dashboard.get("profile/desktop/difference", status=409)["error"]
    assert (error["code"], gone in error["what"]) == ("profile_unreadable", True)


def test_a_switch_asks_the_supervisor(on_desktop):
    wanted = {"name": "jetson_thor", "may_restart": True}
    request_id = on_desktop.post("profile", body=wanted)["request_id"]
    assert on_desktop.robot.hears("profile_request") == [
        {
            "request_id": request_id,
            "profile": "jetson_thor",
            "allow_restart": True,
            "dry_run": False,
        }
    ]


def test_the_own_profile_that_the_run_has_begun_with_is_a_way_back(dashboard, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('inherits = "desktop"\ncamera_rate_hz = 4\n')
    dashboard.robot.shows("profile_status", profile="desktop", begun_with=str(own))
    offered = dashboard.get("profile")["available"][0]
    assert (offered["name"], offered["inherits"]) == (str(own), ["desktop", "base"])
    keys = dashboard.get(f"profile/{quote(str(own), safe='')}/difference")["keys"]
    assert keys == {"camera_rate_hz": {"current": 5, "wanted": 4}}
    dashboard.post("profile", body={"name": str(own)})
    assert [asked["profile"] for asked in dashboard.robot.hears("profile_request")] == [str(own)]


def test_an_own_profile_that_is_gone_does_not_hide_the_others(dashboard):
    dashboard.robot.shows("profile_status", profile="desktop", begun_with="/etc/gone.toml")
    first, *others = dashboard.get("profile")["available"]
    assert (first["name"], first["inherits"]) == ("/etc/gone.toml", [])
    assert "desktop" in [one["name"] for one in others]


@pytest.mark.parametrize("name", ["nowhere", "base", "/etc/passwd.toml", "../profiles/desktop", ""])
def test_no_profile_but_those_offered_is_taken(on_desktop, name):
    on_desktop.post("profile", status=404, body={"name": name})
    assert on_desktop.robot.hears("profile_request") == []
