import cv2
import numpy as np
import pytest

from vla_deploy.model_servers.checking import check_server

MODELS = {"data": [{"id": "tiny"}]}


def test_a_server_with_the_model_is_ok(loopback, open_server):
    loopback.then(loopback.sends(200, MODELS))
    found = check_server(open_server(loopback.url), ask=False)
    assert found.is_ok
    assert (found.is_reachable, found.has_model, found.says_vision) == (True, True, None)
    assert found.latency_s is not None
    assert loopback.heard[0].method == "GET"


def test_a_server_without_the_model_says_what_it_has(loopback, open_server):
    loopback.then(loopback.sends(200, {"data": [{"id": "huge"}]}))
    found = check_server(open_server(loopback.url), ask=True)
    assert not found.is_ok
    assert found.detail == "it has: huge"
    assert len(loopback.heard) == 1


@pytest.mark.parametrize(("colour", "sees"), [("red", True), ("green", False)])
def test_a_model_proves_that_it_sees_by_a_red_card(loopback, open_server, colour, sees):
    loopback.then(loopback.sends(200, MODELS), loopback.says(f'{{"colour": "{colour}"}}'))
    found = check_server(open_server(loopback.url, vision=True), ask=True)
    assert (found.answers, found.sees, found.is_ok) == (True, sees, sees)
    assert found.asked_by == "json_schema"
    url = loopback.heard[1].body["messages"][-1]["content"][0]["image_url"]["url"]
    import base64

    jpeg = np.frombuffer(base64.b64decode(url.partition(",")[2]), np.uint8)
    blue, _, red = cv2.imdecode(jpeg, cv2.IMREAD_COLOR).mean(axis=(0, 1))
    assert red > 200 > 60 > blue


def test_a_server_that_is_away_or_talks_nonsense_fails_with_the_reason(loopback, open_server):
    assert (
        "no connection"
        in check_server(open_server("http://127.0.0.1:1", max_attempts=1), ask=False).detail
    )
    loopback.then(loopback.sends(200, b"<html>"))
    found = check_server(open_server(loopback.url), ask=True)
    assert (found.is_reachable, found.is_ok) == (True, False)


def test_asking_needs_the_permission_that_telling_needs(loopback, open_server):
    loopback.then(loopback.sends(200, MODELS))
    found = check_server(open_server(loopback.url, location="remote"), ask=True)
    assert (found.answers, len(loopback.heard)) == (False, 1)
    assert "allow_text_off_robot" in found.detail
