"""The page comes with the stop door's address, and with rules that keep it to this robot."""

import re

import pytest


def policy(answer):
    rules = answer.headers["content-security-policy"].split("; ")
    return dict(rule.split(" ", 1) for rule in rules)


def door(answer):
    return re.search(r'name="stop-door" content="([^"]*)"', answer.text)[1]


def test_the_page_names_the_stop_door_by_the_name_that_the_browser_used(dashboard):
    dashboard.robot.shows("stop_door_status", port=9001)
    answer = dashboard.client.get("/")
    assert door(answer) == "http://127.0.0.1:9001"
    assert policy(answer)["connect-src"] == "'self' http://127.0.0.1:9001"
    assert answer.headers["cache-control"] == "no-store"


def test_before_the_stop_door_has_told_the_settings_say_where_it_is(dashboard):
    answer = dashboard.client.get("/", headers={"host": "localhost:8088"})
    assert door(answer) == "http://localhost:8089"


@pytest.mark.parametrize("host", ['"><script>alert(1)</script>', "a b", "x'; script-src *", ""])
def test_a_host_that_is_none_never_reaches_page_or_policy(dashboard, host):
    answer = dashboard.client.get("/", headers={"host": host})
    assert host not in answer.text or not host
    assert "*" not in answer.headers.get("content-security-policy", "")


def test_no_script_but_the_pages_own_may_run_and_nothing_may_frame_it(dashboard):
    rules = policy(dashboard.client.get("/"))
    assert rules["default-src"] == rules["base-uri"] == rules["frame-ancestors"] == "'none'"
    assert rules["script-src"] == rules["style-src"] == "'self'"
    assert not any("unsafe" in rule for rule in rules.values())


def test_every_answer_carries_the_rules(dashboard):
    for path in ("/", "/static/main.js", "/api/v1/state", "/nowhere"):
        headers = dashboard.client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert "content-security-policy" in headers


def test_files_of_the_page_are_asked_for_anew_and_answered_briefly(dashboard):
    answer = dashboard.client.get("/static/main.js")
    assert answer.headers["content-type"].startswith("text/javascript")
    assert answer.headers["cache-control"] == "no-cache"
    again = dashboard.client.get(
        "/static/main.js", headers={"if-none-match": answer.headers["etag"]}
    )
    assert (again.status_code, again.content) == (304, b"")


@pytest.mark.parametrize(
    "path", ["/static/../app.py", "/static/%2e%2e/app.py", "/static//etc/passwd"]
)
def test_nothing_beside_the_page_is_served(dashboard, path):
    assert dashboard.client.get(path).status_code == 404


def test_what_is_not_there_is_told_as_every_other_error(dashboard):
    error = dashboard.client.get("/api/v1/nowhere").json()["error"]
    assert (error["code"], sorted(error)) == ("not_found", ["code", "try", "what"])
